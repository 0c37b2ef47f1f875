//! Entity text.

use bsp::entity::{self, Entity, atof, unescape};
use bsp::styles::{Blend, LightStyles};
use bsp::{Limits, WarningKind, Warnings};

fn parse(text: &[u8]) -> (Vec<Entity>, Warnings) {
    let mut warnings = Warnings::new();
    let entities = entity::parse(text, &Limits::default(), &mut warnings).unwrap();
    (entities, warnings)
}

fn one(text: &str) -> Entity {
    let (entities, warnings) = parse(text.as_bytes());
    assert!(warnings.is_empty(), "{warnings:?}");
    entities[0].clone()
}

#[test]
fn grammar_takes_what_levels_have() {
    let text = b"// a comment\n{ /* more */ \"classname\" \"worldspawn\" key value\n\
        \"path\" \"a\\b{c}//d\" \"trailing  \" \"kept  \" \"\" \"empty key\" }\n\
        {\"classname\"\"light\"}\0{ \"classname\" \"after the end\" }";
    let (entities, warnings) = parse(text);
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(entities.len(), 2);
    assert_eq!(entities[0].get("key"), Some("value"));
    assert_eq!(entities[0].get("path"), Some("a\\b{c}//d"));
    assert_eq!(entities[0].get("trailing"), Some("kept  "));
    assert_eq!(entities[1].classname(), "light");
}

#[test]
fn keys_are_compared_exactly_first_and_the_last_duplicate_wins() {
    let e = one(r#"{ "Classname" "x" "light" "1" "light" "2" "LIGHT" "3" "_color" "1 2" }"#);
    assert_eq!(e.get("light"), Some("2"));
    assert_eq!(e.get("Light"), Some("3"));
    assert_eq!(e.classname(), "x");
    assert_eq!(e.get("color"), None);
    assert_eq!(e.vec3_loose("color"), Some([1.0, 2.0, 0.0]));
    assert_eq!(e.get_any(&["mangle", "color"]), Some("1 2"));
}

#[test]
fn numbers_are_read_as_atof_reads_them() {
    let cases = [
        ("1.", 1.0),
        (".5", 0.5),
        ("+1", 1.0),
        ("-2.5e2xyz", -250.0),
        ("1e", 1.0),
        ("  7 8", 7.0),
        ("", 0.0),
        ("abc", 0.0),
        ("nan", 0.0),
        ("inf", 0.0),
        ("-", 0.0),
        (".", 0.0),
        ("0x10", 0.0),
    ];
    for (text, value) in cases {
        assert_eq!(atof(text), value, "{text:?}");
    }
    let e = one(r#"{ "huge" "1e9" "v" "1 junk 3" "spawnflags" "257.0" "neg" "-1" }"#);
    assert_eq!(e.float("huge"), None);
    assert_eq!(e.float("absent"), None);
    assert_eq!(e.vec3("v"), Some([1.0, 0.0, 3.0]));
    assert_eq!(e.spawnflags(), 257);
    assert_eq!(e.int("neg"), Some(-1));
}

#[test]
fn angles_come_from_either_key() {
    let e = one(r#"{ "angle" "90" }"#);
    assert_eq!(e.angles_deg(), Some([0.0, 90.0, 0.0]));
    let [x, y, z] = e.move_direction();
    assert!(x.abs() < 1e-6 && (y - 1.0).abs() < 1e-6 && z == 0.0);
    assert_eq!(one(r#"{ "angle" "-1" }"#).move_direction(), [0.0, 0.0, 1.0]);
    assert_eq!(
        one(r#"{ "angle" "-2" }"#).move_direction(),
        [0.0, 0.0, -1.0]
    );
    let both = one(r#"{ "angle" "90" "angles" "10 20 30" }"#);
    assert_eq!(both.angles_deg(), Some([10.0, 20.0, 30.0]));
    assert_eq!(one(r#"{ "x" "y" }"#).angles_deg(), None);
    // Positive pitch looks down.
    assert!(both.move_direction()[2] < 0.0);
}

#[test]
fn gotcha_23_brush_model_references() {
    let model = |text: &str| one(&format!("{{ \"model\" \"{text}\" }}")).brush_model();
    assert_eq!(model("*12"), Some(12));
    assert_eq!(model("*999"), Some(999));
    for bad in ["*", "*-1", "*x", "progs/x.mdl", "*99999999999999999999999"] {
        assert_eq!(model(bad), None);
    }
}

#[test]
fn gotcha_24_unbalanced_text_is_read_to_its_end() {
    let cases: [(&[u8], usize); 7] = [
        (
            b"{ \"classname\" \"worldspawn\" } { \"classname\" \"light\"",
            2,
        ),
        (
            b"{ \"classname\" \"worldspawn\" { \"classname\" \"light\" }",
            2,
        ),
        (b"} { \"classname\" \"worldspawn\" } }", 1),
        (b"{ \"classname\" \"worldspawn\" \"key\" }", 1),
        (b"{ \"classname\" \"worldspawn\" \"key\" \"unterminated", 1),
        (b"stray { \"classname\" \"worldspawn\" } words", 1),
        (b"{ \"classname\" \"worldspawn\" } {", 1),
    ];
    for (text, count) in cases {
        let (entities, warnings) = parse(text);
        assert_eq!(entities.len(), count, "{:?}", String::from_utf8_lossy(text));
        assert!(warnings.has(WarningKind::EntitySyntax));
        assert_eq!(entities[0].classname(), "worldspawn");
    }
}

#[test]
fn gotcha_24_entities_without_a_class() {
    let (entities, warnings) = parse(b"{ \"message\" \"x\" } { \"origin\" \"0 0 0\" } {}");
    assert_eq!(
        entities.len(),
        1,
        "the first is worldspawn even without a name"
    );
    assert_eq!(warnings.count(WarningKind::EntityDropped), 2);
    assert!(parse(b"").0.is_empty());
}

#[test]
fn gotcha_25_huge_values_and_many_keys() {
    let long = "x".repeat(100_000);
    let mut text = format!("{{ \"classname\" \"worldspawn\" \"wad\" \"{long}\"");
    for i in 0..70_000 {
        text += &format!(" \"k{i}\" \"v\"");
    }
    text += "}";
    let e = one(&text);
    assert_eq!(e.get("wad"), Some(long.as_str()));
    assert_eq!(e.len(), 70_002);
    assert_eq!(e.get("k69999"), Some("v"));
    let limits = Limits {
        max_entity_bytes: 10,
        ..Limits::default()
    };
    assert!(entity::parse(text.as_bytes(), &limits, &mut Warnings::new()).is_err());
}

#[test]
fn gotcha_26_coloured_and_escaped_text() {
    let (entities, _) = parse(b"{ \"message\" \"\xc1\xe2c\\nd\" \"k\xe9y\" \"v\" }");
    let e = &entities[0];
    assert_eq!(e.get("message"), Some("Abc\\nd"));
    assert_eq!(e.get_raw("message"), Some(&b"\xc1\xe2c\\nd"[..]));
    assert_eq!(unescape(e.get("message").unwrap()), "Abc\nd");
    assert_eq!(unescape("a\\bgold\\b\\x\\"), "agold\\\\");
    // Keys are compared as they are stored.
    assert_eq!(e.get("kiy"), None);
}

#[test]
fn switchable_lights_start_as_they_say() {
    let (entities, _) = parse(
        br#"{ "classname" "worldspawn" }
        { "classname" "light_fluoro" "style" "33" "spawnflags" "1" }
        { "classname" "light" "style" "34" }
        { "classname" "light" "style" "2" "spawnflags" "1" }"#,
    );
    let styles = LightStyles::at_start(&entities);
    assert_eq!(styles.brightness(33, 0.0, Blend::Step), 0.0);
    assert_eq!(styles.brightness(34, 0.0, Blend::Step), 264.0 / 256.0);
    assert!(styles.brightness(2, 1.2, Blend::Step) > 0.9);
}
