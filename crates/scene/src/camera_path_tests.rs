use super::*;

/// A few dozen keys by numbers that look random, with keys that rest and turns over 180 degrees.
fn wild() -> CameraPath {
    let mut state = 7u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    let mut time = -3.0;
    let mut keys: Vec<Key> = Vec::new();
    for i in 0..40 {
        time += 0.05 + 3.0 * f64::from(next()).powi(3);
        let mut key = Key {
            time,
            position: Vec3::new(next(), next(), next()) * 1000.0 - 500.0,
            angles_deg: [
                next() * 160.0 - 80.0,
                next() * 720.0 - 360.0,
                next() * 40.0 - 20.0,
            ],
            fov_deg: 20.0 + 100.0 * next(),
            aperture: (next() * 4.0 - 1.0).max(0.0),
            focus: (i > 0).then(|| 10.0 + 300.0 * next()),
        };
        if let Some(before) = keys.last().filter(|_| i % 5 == 4) {
            key = Key {
                time,
                ..before.clone()
            };
        }
        if i == 0 {
            key.aperture = 0.0;
        }
        keys.push(key);
    }
    CameraPath::new(keys).unwrap()
}

/// Position, angles, field of view, radius; angles may be whole turns off.
fn numbers(camera: &Camera) -> [f64; 8] {
    let [x, y, z] = camera.position.to_array();
    let radius = camera.lens.map_or(0.0, |l| l.radius);
    let Camera {
        pitch_deg,
        yaw_deg,
        roll_deg,
        fov_deg,
        ..
    } = *camera;
    [x, y, z, pitch_deg, yaw_deg, roll_deg, fov_deg, radius].map(f64::from)
}

#[test]
fn a_flight_passes_through_its_keys() {
    let path = wild();
    for key in path.keys() {
        let camera = path.at(key.time);
        assert_eq!(camera.position, key.position);
        for (a, b) in [camera.pitch_deg, camera.yaw_deg, camera.roll_deg]
            .iter()
            .zip(key.angles_deg)
        {
            let off = (a - b + 180.0).rem_euclid(360.0) - 180.0;
            assert!(off.abs() < 1e-3, "{a} for {b}");
        }
        assert_eq!(
            (camera.fov_deg, camera.lens.map_or(0.0, |l| l.radius)),
            (key.fov_deg, key.aperture)
        );
        assert!(camera.lens.is_none_or(|l| Some(l.focus) == key.focus));
    }
    let [first, last] = path.times();
    assert_eq!(path.at(first - 9.0), path.at(first));
    assert_eq!(path.at(last + 9.0), path.at(last));
    assert_eq!(path.at(f64::NAN), path.at(first));
}

#[test]
fn a_flight_has_no_kinks_and_nothing_overshoots() {
    let path = wild();
    let times: Vec<f64> = path.keys().iter().map(|k| k.time).collect();
    for (i, pair) in path.nodes.windows(2).enumerate() {
        let span = [times[i], times[i + 1]];
        let h = span[1] - span[0];
        // Slopes within the span, by differences at its ends, are those of the keys.
        let at = |u: f64| between(&pair[0], &pair[1], span, span[0] + u * h);
        let step = 1e-6;
        for c in 0..9 {
            let (start, end) = (at(step)[c] - at(0.0)[c], at(1.0)[c] - at(1.0 - step)[c]);
            for (slope, key) in [(start, &pair[0]), (end, &pair[1])] {
                let slope = slope / (step * h);
                let scale = 1.0 + pair[0][0][c].abs().max(pair[1][0][c].abs()) / h;
                assert!(
                    (slope - key[1][c]).abs() < 1e-3 * scale,
                    "span {i}, {c}: {slope}"
                );
            }
        }
        let (a, b) = (&pair[0][0], &pair[1][0]);
        let rests = a[POSITION] == b[POSITION];
        for u in (0..=50).map(|u| f64::from(u) / 50.0) {
            let now = at(u);
            for c in POSITION.end..9 {
                assert!(
                    (a[c].min(b[c])..=a[c].max(b[c])).contains(&now[c]),
                    "span {i}, {c}"
                );
            }
            assert!(
                !rests || now[POSITION] == a[POSITION],
                "it should stand still"
            );
        }
        for c in ANGLES {
            assert!((a[c] - b[c]).abs() <= 180.0, "the shorter way");
        }
    }
}

#[test]
fn one_key_stands_still_and_two_make_a_straight_even_flight() {
    let camera = |x: f32, yaw_deg| Camera {
        name: String::new(),
        position: Vec3::new(x, 2.0, 3.0),
        pitch_deg: 5.0,
        yaw_deg,
        roll_deg: 0.0,
        fov_deg: 80.0,
        lens: Lens::new(x, 9.0),
    };
    let still = CameraPath::new(vec![Key::new(4.0, &camera(1.0, 10.0))]).unwrap();
    for time in [-1e9, 4.0, 1e9] {
        assert_eq!(numbers(&still.at(time)), numbers(&camera(1.0, 10.0)));
    }
    let keys = vec![
        Key::new(1.0, &camera(0.0, 350.0)),
        Key::new(3.0, &camera(8.0, 30.0)),
    ];
    let path = CameraPath::new(keys).unwrap();
    // Through 360 degrees; the lens opens at the focus it will have.
    let expected = numbers(&camera(2.0, 360.0));
    for (a, b) in numbers(&path.at(1.5)).iter().zip(expected) {
        assert!((a - b).abs() < 1e-5, "{a} for {b}");
    }
    assert_eq!(path.at(1.5).lens, Lens::new(2.0, 9.0));
    assert_eq!(path.at(1.0).lens, None);
}

#[test]
fn texts_are_read_and_written() {
    let path = wild();
    let again = CameraPath::parse("a.toml", &path.to_toml()).unwrap();
    assert_eq!(again.keys().len(), path.keys().len());
    // What a key does not say it has from the key before, as here.
    assert_eq!(again, path);
    let text = "[[key]]\ntime = 0\nposition = [1, 2, 3]\nangles = [0, 90, 0]\n\
                [[key]]\ntime = 2\nposition = [4, 5, 6]\nangles = [0, 90, 0]\naperture = 2\nfocus = 50\n\
                [[key]]\ntime = 3\nposition = [4, 5, 6]\nangles = [0, 90, 0]\nfov = 40\n";
    let keys = CameraPath::parse("a", text).unwrap().keys().to_vec();
    assert_eq!(
        (keys[0].fov_deg, keys[0].aperture, keys[0].focus),
        (90.0, 0.0, None)
    );
    assert_eq!(
        (keys[2].fov_deg, keys[2].aperture, keys[2].focus),
        (40.0, 2.0, Some(50.0))
    );
}

#[test]
fn errors_name_file_key_and_field() {
    let key = |time: &str, rest: &str| {
        format!("[[key]]\ntime = {time}\nposition = [0, 0, 0]\nangles = [0, 0, 0]\n{rest}\n")
    };
    let two = |a: &str, b: &str, rest: &str| key(a, "") + &key(b, rest);
    for (text, what) in [
        (
            String::new(),
            "p.toml: a camera path has at least one [[key]]",
        ),
        (
            two("1", "1", ""),
            "p.toml: key 2 (line 6): time: 1 is not after 1, that of the key before",
        ),
        (
            key("nan", ""),
            "p.toml: key 1 (line 1): time: NaN is not a number from -1000000 to 1000000",
        ),
        (
            two("0", "1", "fov = 171"),
            "p.toml: key 2 (line 6): fov: 171 is not a number from 1 to 170",
        ),
        (
            key("0", "aperture = 1"),
            "p.toml: key 1 (line 1): focus: it is missing, and the aperture is not 0",
        ),
        (key("0", "focus = -1"), "focus: -1 is not"),
        (
            key("0", "aperture = inf\nfocus = 1"),
            "aperture: inf is not",
        ),
        (key("0", "zoom = 1"), "unknown field `zoom`"),
        (
            "[[key]]\ntime = 0\nposition = [1, 2]\nangles = [0, 0, 0]".into(),
            "array of length 3",
        ),
        ("[[key]]\ntime = \"now\"".into(), "line 2"),
        ("[[key]]\ntime = 0".into(), "missing field `position`"),
    ] {
        let error = CameraPath::parse("p.toml", &text).unwrap_err().to_string();
        assert!(
            error.starts_with("p.toml: ") && error.contains(what),
            "{error}"
        );
    }
    let many = vec![Key::new(0.0, &wild().at(0.0)); MAX_KEYS + 1];
    assert!(
        CameraPath::new(many)
            .unwrap_err()
            .to_string()
            .contains("65536")
    );
}
