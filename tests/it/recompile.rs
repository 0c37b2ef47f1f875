//! A level that is compiled again and again, at times badly: the window stays, and so does all memory.

use runelight::view::app::App;
use runelight::view::session::Session;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Set in the process whose memory is looked at: the other tests' is none of it.
const INSIDE: &str = "RUNELIGHT_TEST_RECOMPILE";
const LIMIT: Duration = Duration::from_secs(120);
const ROUNDS: usize = 50;
/// Rounds in which memory may still grow: caches fill, threads get arenas.
const WARM: usize = 15;

#[test]
fn a_level_that_is_compiled_anew_is_read_anew_and_leaks_nothing() {
    if std::env::var_os(INSIDE).is_some() {
        return inside();
    }
    let this = std::env::current_exe().expect("this program");
    let name = "recompile::a_level_that_is_compiled_anew_is_read_anew_and_leaks_nothing";
    let output = Command::new(this)
        .args(["--exact", name, "--nocapture"])
        .env(INSIDE, "1")
        .output()
        .expect("this program");
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said);
    println!("{said}");
    assert!(
        output.status.success() && said.contains("rounds are over"),
        "{said}"
    );
}

/// Bytes of this process that lie in memory; `None` where the system does not say so.
fn resident() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/statm").ok()?;
    let pages: u64 = text.split(' ').nth(1)?.parse().ok()?;
    Some(pages * 4096)
}

fn inside() {
    let good = gallery::level::compile(&gallery::level::room("glow"));
    let name = format!("runelight-recompile-{}.bsp", std::process::id());
    let file = std::env::temp_dir().join(name);
    let write = |bytes: &[u8], round: usize| {
        // A byte behind the end changes nothing but the length, as a new compilation would.
        let more = [bytes, &vec![0; round]].concat();
        std::fs::write(&file, more).expect("a level");
    };
    write(&good, 0);
    let path = file.display().to_string();
    let args = ["--spp", "1", "--depth", "2", &path];
    // The validation layer keeps a record of its own of all that is made; other tests have it.
    let mut session = crate::viewer::opened(&args, false);
    session.resize([32, 24]).expect("a size");
    session.until(LIMIT, App::is_done).expect("a picture");
    session.frames(2).expect("frames");
    let (title, picture) = (session.app.title(), session.picture().expect("a frame"));
    let (mut device, mut host) = (Vec::new(), Vec::new());
    for round in 1..=ROUNDS {
        let is_broken = round % 10 == 0;
        let length = if is_broken {
            good.len() * round / 60
        } else {
            good.len()
        };
        write(&good[..length], round);
        touched(&mut session, &file);
        let errors = session.app.notices.all().iter().filter(|n| n.is_error);
        assert_eq!(errors.count(), usize::from(is_broken), "round {round}");
        session.app.notices.pass(1e3);
        session.frames(3).expect("frames");
        assert_eq!(session.app.title(), title);
        assert!(
            session.picture().expect("a frame") == picture,
            "round {round}"
        );
        device.push(session.app.gpu.allocated_bytes());
        host.extend(resident());
    }
    std::fs::remove_file(&file).expect("a file to remove");
    println!("device: {device:?}\nhost: {host:?}");
    // Where things lie moves what is lost between them, by some hundred bytes.
    let (warm, last) = (device[WARM], device[ROUNDS - 1]);
    assert!(last < warm + 4096, "the device's memory: {device:?}");
    if let (Some(warm), Some(last)) = (host.get(WARM), host.last()) {
        // It does not grow by a page here; a pipeline that was kept would be some megabytes each time.
        let grown = last.saturating_sub(*warm) >> 20;
        assert!(
            grown < 4,
            "{grown} MiB in {} rounds: {host:?}",
            ROUNDS - WARM
        );
    }
    println!("{ROUNDS} rounds are over");
}

/// Frames until the window has seen that the file is another, and has done with it.
fn touched(session: &mut Session, file: &Path) {
    let name = file.display().to_string();
    // The file is looked at now and then, and taken when it rests.
    let seen =
        |app: &App| !app.is_done() || app.notices.all().iter().any(|n| n.text.contains(&name));
    session.until(LIMIT, seen).expect("it is seen");
    session.until(LIMIT, App::is_done).expect("a picture");
}
