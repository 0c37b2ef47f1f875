//! Writes the level of `runelight_tests::light_modes`, without light: `light_modes OUT.bsp`.

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("where to?")?;
    let out = mapc::compile(
        &runelight_tests::light_modes::map(),
        &mapc::Options::default(),
    )?;
    for warning in &out.warnings {
        eprintln!("{warning}");
    }
    std::fs::write(path, out.bytes)?;
    Ok(())
}
