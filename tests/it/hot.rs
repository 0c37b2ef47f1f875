//! Shaders that somebody works on while the window shows what they make: new ones are taken, broken ones are not.

use runelight::view::app::App;
use runelight::view::session::Session;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Set in the process whose shaders change: they are all of its pipelines'.
const INSIDE: &str = "RUNELIGHT_TEST_HOT";
const LIMIT: Duration = Duration::from_secs(240);

#[test]
fn shaders_that_are_written_are_used_and_broken_ones_are_told() {
    if std::env::var_os(INSIDE).is_some() {
        return inside();
    }
    let this = std::env::current_exe().expect("this program");
    let name = "hot::shaders_that_are_written_are_used_and_broken_ones_are_told";
    let output = Command::new(this)
        .args(["--exact", name, "--nocapture"])
        .env(INSIDE, "1")
        .output()
        .expect("this program");
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said);
    assert!(
        output.status.success() && said.contains("the shaders are as they were"),
        "{said}"
    );
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("shaders").flatten() {
        let (from, to) = (entry.path(), to.join(entry.file_name()));
        if from.is_dir() {
            copy(&from, &to);
        } else {
            std::fs::copy(&from, &to).expect("a file");
        }
    }
}

/// Frames until a sentence with this in it has been said; the sentence.
fn said(session: &mut Session, part: &str) -> String {
    let has = |app: &App| {
        let mut all = app.notices.all().iter();
        (all.find(|n| n.text.contains(part))).map(|n| n.text.clone())
    };
    session.until(LIMIT, |app| has(app).is_some()).expect(part);
    let text = has(&session.app).expect(part);
    session.app.notices.pass(1e3);
    session.until(LIMIT, App::is_done).expect("a picture");
    text
}

fn inside() {
    let folder = std::env::temp_dir().join(format!("runelight-hot-{}", std::process::id()));
    let shaders = folder.join("shaders");
    copy(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("../shaders"),
        &shaders,
    );
    std::fs::create_dir_all(folder.join("crates/rt")).expect("a folder");
    let mut session = crate::viewer::session(&["--spp", "2", "--depth", "2", "--no-entities"]);
    session.app.watch_shaders(shaders.clone());
    session.until(LIMIT, App::is_done).expect("a picture");
    let film = |session: &mut Session| {
        session
            .app
            .film()
            .expect("a device")
            .expect("a film")
            .beauty
    };
    let first = film(&mut session);

    let file = shaders.join("path_trace.rgen");
    let source = std::fs::read_to_string(&file).expect("a shader");
    let line = "film_sample(film, path, radiance);";
    assert_eq!(source.matches(line).count(), 1, "the line that is changed");
    let doubled = source.replace(line, "film_sample(film, path, 2.0 * radiance);");
    std::fs::write(&file, &doubled).expect("a shader");
    said(&mut session, "compiled anew");
    let twice: Vec<[f32; 3]> = first.iter().map(|p| p.map(|v| 2.0 * v)).collect();
    assert!(film(&mut session) == twice, "the new shader is used");

    std::fs::write(&file, doubled.replace("2.0 * radiance", "oops")).expect("a shader");
    let told = said(&mut session, "the old shaders stay");
    let at = source
        .lines()
        .position(|l| l.contains(line))
        .expect("the line")
        + 1;
    assert!(told.contains(&format!("path_trace.rgen:{at}:")), "{told}");
    // Traced again it is still what it was.
    session.app.args.picture.seed += 1;
    session.until(LIMIT, App::is_done).expect("a picture");
    session.app.args.picture.seed -= 1;
    session.frame().expect("a frame");
    session.until(LIMIT, App::is_done).expect("a picture");
    assert!(film(&mut session) == twice, "the old pipeline stays");

    std::fs::write(&file, source).expect("a shader");
    said(&mut session, "compiled anew");
    assert!(film(&mut session) == first);
    std::fs::remove_dir_all(&folder).expect("a folder to remove");
    assert_eq!(session.app.gpu.validation_messages(), [""; 0]);
    println!("the shaders are as they were");
}
