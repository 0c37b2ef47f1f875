use super::*;
use crate::picture;
use scene::render::StyleLayer;

fn film(width: u32, height: u32) -> Film {
    let n = (width * height) as usize;
    let rgb = |k: f32| -> Vec<[f32; 3]> {
        (0..n)
            .map(|i| [i as f32 * k, 1.5 + k, 70_000.0 * k])
            .collect()
    };
    Film {
        width,
        height,
        samples: 17,
        beauty: rgb(1.0),
        variance: rgb(1e-9),
        emission: rgb(0.25),
        direct: rgb(0.5),
        indirect: rgb(0.75),
        albedo: rgb(0.01),
        normal: rgb(-0.1),
        position: rgb(33.3),
        motion: (0..n).map(|i| [i as f32, -0.123]).collect(),
        depth: (0..n).map(|i| 1234.567 + i as f32).collect(),
        id: (0..n as u32).map(|i| i * 100_000).collect(),
        styles: [0, 33]
            .map(|number| StyleLayer {
                number,
                brightness: 0.5,
                radiance: vec![[f32::from(number), 0.25, 2.0]; n],
            })
            .into(),
        ..Film::default()
    }
}

fn style(half: bool) -> Style {
    Style {
        layers: Layer::ALL.to_vec(),
        half,
        notes: vec![
            ("level", Note::Text("sample".into())),
            ("spp", Note::Int(17)),
            ("seed", Note::Int(i64::MAX)),
            ("fov", Note::Float(90.0)),
        ],
        ..Style::default()
    }
}

#[test]
fn every_layer_of_an_exr_comes_back_as_it_was() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let film = film(7, 5);
    for half in [false, true] {
        let outputs = Outputs::open(std::slice::from_ref(&path)).unwrap();
        assert_eq!(
            outputs.write(&film, &style(half)).unwrap(),
            std::slice::from_ref(&path)
        );
        for style in &film.styles {
            let read = picture::read(&path, &format!("style.{}", style.number)).unwrap();
            assert_eq!(read.radiance, style.radiance);
        }
        for layer in Layer::ALL.into_iter().filter(|&l| l != Layer::Style) {
            let read = picture::read(&path, layer.name()).unwrap();
            assert_eq!((read.width, read.height), (7, 5));
            let expected: Vec<[f32; 3]> = match layer.plane(&film) {
                Plane::Rgb(v) => v.to_vec(),
                Plane::Xy(v) => v.iter().map(|&[x, y]| [x, y, y]).collect(),
                Plane::Float(v) => v.iter().map(|&x| [x; 3]).collect(),
                Plane::Uint(v) => v.iter().map(|&x| [x as f32; 3]).collect(),
                Plane::Constant(v) => vec![[v as f32; 3]; 35],
                Plane::Styles(_) => unreachable!(),
            };
            for (a, b) in read
                .radiance
                .iter()
                .flatten()
                .zip(expected.iter().flatten())
            {
                // Half has 11 bits and ends at 65504; whatever was finite stays finite.
                let b = if half && layer.may_be_half() {
                    b.clamp(-65504.0, 65504.0)
                } else {
                    *b
                };
                let tolerance = if half && layer.may_be_half() {
                    b.abs() / 2048.0
                } else {
                    0.0
                };
                assert!(
                    (a - b).abs() <= tolerance,
                    "{layer:?} half {half}: {a} != {b}"
                );
            }
        }
    }
    let error = format!("{:#}", picture::read(&path, "shadow").unwrap_err());
    assert!(
        error.contains("no layer \"shadow\"") && error.contains("indirect"),
        "{error}"
    );
}

#[test]
fn an_exr_says_what_it_shows() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    (Outputs::open(std::slice::from_ref(&path)).unwrap())
        .write(&film(2, 2), &style(false))
        .unwrap();
    let meta = exr::meta::MetaData::read_from_file(&path, true).unwrap();
    assert_eq!(meta.headers.len(), 1);
    let attributes = &meta.headers[0].own_attributes.other;
    let get = |name: &str| {
        attributes
            .get(&exr::prelude::Text::from(name))
            .unwrap()
            .clone()
    };
    use exr::meta::attribute::AttributeValue as V;
    assert_eq!(get("runelight:level"), V::Text("sample".into()));
    assert_eq!(get("runelight:spp"), V::I32(17));
    assert_eq!(get("runelight:seed"), V::Text("9223372036854775807".into()));
    assert_eq!(get("runelight:fov"), V::F32(90.0));
}

#[test]
fn the_same_picture_is_the_same_file() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str| {
        let path = dir.path().join(name);
        let outputs = Outputs::open(std::slice::from_ref(&path)).unwrap();
        outputs.write(&film(40, 30), &style(false)).unwrap();
        std::fs::read(path).unwrap()
    };
    let first = write("0.exr");
    // Unsorted, four notes would come in the same order all eight times once in 24^8.
    for i in 1..9 {
        assert!(write(&format!("{i}.exr")) == first, "file {i} differs");
    }
}

#[test]
fn a_png_holds_the_tone_mapped_beauty() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.PNG");
    let film = film(3, 2);
    let style = Style {
        exposure: -2.0,
        ..style(false)
    };
    (Outputs::open(std::slice::from_ref(&path)).unwrap())
        .write(&film, &style)
        .unwrap();
    let read = picture::read(&path, "beauty").unwrap();
    let codes = read.codes.unwrap();
    for (code, radiance) in codes.iter().zip(&film.beauty) {
        let bytes = code.map(|c| (c * 255.0).round() as u8);
        assert_eq!(
            bytes,
            crate::tonemap::display_u8(*radiance, -2.0, Tonemap::Agx)
        );
    }
    assert!(picture::read(&path, "albedo").is_err());
}

#[test]
fn outputs_are_all_opened_or_none() {
    let dir = tempfile::tempdir().unwrap();
    let good = dir.path().join("a.exr");
    std::fs::write(&good, "precious").unwrap();
    let open = |second: &Path| Outputs::open(&[good.clone(), second.to_owned()]);
    for (second, sentence) in [
        (good.clone(), "given twice"),
        (dir.path().join("a.jpg"), "an output ends in .exr or .png"),
        (dir.path().join("none/a.png"), "cannot be written"),
    ] {
        let error = format!("{:#}", open(&second).unwrap_err());
        assert!(error.contains(sentence), "{error}");
    }
    // Opened, but never finished.
    drop(open(&dir.path().join("b.png")).unwrap());
    assert_eq!(std::fs::read(&good).unwrap(), b"precious");
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn exr_files_of_other_tools_are_read() {
    use exr::prelude::*;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let pixel = |p: Vec2<usize>| (p.x() as f32, f16::from_f32(0.5), 2.0f32, 1.0f32);
    Image::from_channels((4, 3), SpecificChannels::rgba(pixel))
        .write()
        .to_file(&path)
        .unwrap();
    let read = picture::read(&path, "beauty").unwrap();
    assert_eq!((read.width, read.height), (4, 3));
    assert_eq!(read.radiance[5], [1.0, 0.5, 2.0]);

    // Layers as parts of the file, with plain channel names.
    let part = |name: &str, value: f32| {
        Layer::new(
            (2, 1),
            LayerAttributes::named(name),
            Encoding::FAST_LOSSLESS,
            SpecificChannels::rgb(move |_| (value, value, value)),
        )
    };
    Image::empty(ImageAttributes::with_size((2, 1)))
        .with_layer(part("albedo", 0.25))
        .with_layer(part("beauty", 3.0))
        .write()
        .to_file(&path)
        .unwrap();
    assert_eq!(
        picture::read(&path, "albedo").unwrap().radiance[1],
        [0.25; 3]
    );
    assert_eq!(
        picture::read(&path, "beauty").unwrap().radiance[1],
        [3.0; 3]
    );

    let text = dir.path().join("a.txt");
    std::fs::write(&text, "hello").unwrap();
    let error = picture::read(&text, "beauty").unwrap_err().to_string();
    assert!(error.ends_with("neither an EXR nor a PNG"), "{error}");
}
