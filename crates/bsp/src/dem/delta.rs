//! Replacement deltas: how FTE and vkQuake send entities as changes.

use super::cursor::{Cursor, Read};
use super::message::{EntityState, Fault};

/// Bits of an entity's change.
mod bit {
    pub const FRAME: u32 = 1;
    pub const ORIGIN_XY: u32 = 1 << 1;
    pub const ORIGIN_Z: u32 = 1 << 2;
    pub const ANGLES_XZ: u32 = 1 << 3;
    pub const ANGLE_Y: u32 = 1 << 4;
    pub const EFFECTS: u32 = 1 << 5;
    pub const PREDICTION: u32 = 1 << 6;
    pub const EXTEND: [u32; 3] = [1 << 7, 1 << 15, 1 << 23];
    pub const RESET: u32 = 1 << 8;
    pub const WIDE: u32 = 1 << 9;
    pub const MODEL: u32 = 1 << 10;
    pub const SKIN: u32 = 1 << 11;
    pub const COLORMAP: u32 = 1 << 12;
    pub const SOLID: u32 = 1 << 13;
    pub const FLAGS: u32 = 1 << 14;
    pub const ALPHA: u32 = 1 << 16;
    pub const SCALE: u32 = 1 << 17;
    pub const BONES: u32 = 1 << 18;
    pub const DRAW_FLAGS: u32 = 1 << 19;
    pub const TAG: u32 = 1 << 20;
    pub const LIGHT: u32 = 1 << 21;
    pub const TRAIL: u32 = 1 << 22;
    pub const COLOUR: u32 = 1 << 24;
    pub const GLOW: u32 = 1 << 25;
    pub const FATNESS: u32 = 1 << 26;
    pub const MODEL2: u32 = 1 << 27;
    pub const GRAVITY: u32 = 1 << 28;
    pub const EFFECTS2: u32 = 1 << 29;
    pub const LERP: u32 = 1 << 30;
    pub const UNUSED: u32 = 1 << 31;
}

/// The number of an entity in baselines and tags.
pub fn entity_number(r: &mut Cursor<'_>) -> Read<u32> {
    let low = r.u16()?;
    if low & 0x8000 == 0 {
        return Ok(u32::from(low));
    }
    Ok(u32::from(low & 0x7fff) << 8 | u32::from(r.byte()?))
}

/// What an entity is after a change: `before` is what it was, `None` if it was not there.
/// `predicts` is whether the extension with the players' predictions is on.
pub fn change(
    r: &mut Cursor<'_>,
    before: Option<&EntityState>,
    baseline: &EntityState,
    predicts: bool,
) -> Read<EntityState> {
    let mut bits = u32::from(r.byte()?);
    for (shift, more) in [8, 16, 24].into_iter().zip(bit::EXTEND) {
        if bits & more != 0 {
            bits |= u32::from(r.byte()?) << shift;
        }
    }
    if bits & bit::UNUSED != 0 {
        return Err(Fault::Delta);
    }
    let has = |bit: u32| bits & bit != 0;
    let wide = has(bit::WIDE);
    let mut state = *before.filter(|_| !has(bit::RESET)).unwrap_or(baseline);
    if has(bit::FRAME) {
        state.frame = r.byte_or_short(wide)?;
    }
    place(r, bits, &mut state, predicts)?;
    match (has(bit::EFFECTS), has(bit::EFFECTS2)) {
        (true, true) => state.effects = r.ulong()?,
        (false, true) => state.effects = u32::from(r.u16()?),
        (true, false) => state.effects = u32::from(r.byte()?),
        (false, false) => {}
    }
    state.velocity = if has(bit::PREDICTION) {
        prediction(r, bits, predicts)?
    } else {
        [0.0; 3]
    };
    if has(bit::MODEL) {
        state.model = r.byte_or_short(wide)?;
    }
    if has(bit::SKIN) {
        state.skin = r.byte_or_short(wide)?;
    }
    if has(bit::COLORMAP) {
        state.colormap = r.byte()?;
    }
    if has(bit::SOLID) {
        r.skip(2)?;
    }
    if has(bit::FLAGS) {
        state.flags = r.byte()?;
    }
    if has(bit::ALPHA) {
        state.alpha = r.byte()?.wrapping_add(1);
    }
    if has(bit::SCALE) {
        state.scale = r.byte()?;
    }
    skip_the_rest(r, bits)?;
    Ok(state)
}

fn place(r: &mut Cursor<'_>, bits: u32, state: &mut EntityState, predicts: bool) -> Read<()> {
    let has = |bit: u32| bits & bit != 0;
    let ([x, y, z], [pitch, yaw, roll]) = (&mut state.origin, &mut state.angles);
    if has(bit::ORIGIN_XY) {
        *x = r.coord()?;
        *y = r.coord()?;
    }
    if has(bit::ORIGIN_Z) {
        *z = r.coord()?;
    }
    let fine = has(bit::PREDICTION) && !predicts;
    let mut angle = || if fine { r.angle16() } else { r.angle() };
    if has(bit::ANGLES_XZ) {
        *pitch = angle()?;
        *roll = angle()?;
    }
    if has(bit::ANGLE_Y) {
        *yaw = angle()?;
    }
    Ok(())
}

/// What players predict their own movement by; gives the speed in units per second.
fn prediction(r: &mut Cursor<'_>, bits: u32, predicts: bool) -> Read<[f32; 3]> {
    const MOVES: [u8; 3] = [1, 2, 4];
    const MOVE_TYPE: u8 = 8;
    const VELOCITY_XY: u8 = 0x10;
    const VELOCITY_Z: u8 = 0x20;
    const AGE: u8 = 0x40;
    const LAST: u8 = 0x80;
    let parts = r.byte()?;
    let has = |bit: u8| parts & bit != 0;
    for part in MOVES {
        if has(part) {
            r.skip(2)?;
        }
    }
    if has(MOVE_TYPE) {
        r.skip(1)?;
    }
    let mut velocity = [0.0; 3];
    let [x, y, z] = &mut velocity;
    if has(VELOCITY_XY) {
        *x = f32::from(r.short()?) / 8.0;
        *y = f32::from(r.short()?) / 8.0;
    }
    if has(VELOCITY_Z) {
        *z = f32::from(r.short()?) / 8.0;
    }
    if has(AGE) {
        r.skip(1)?;
    }
    if has(LAST) && predicts {
        // The angles of the view.
        if bits & bit::ANGLES_XZ != 0 {
            r.skip(4)?;
        }
        if bits & bit::ANGLE_Y != 0 {
            r.skip(2)?;
        }
    } else if has(LAST) && r.byte()? & 0x80 != 0 {
        // The second byte of the weapon's frame.
        r.skip(1)?;
    }
    Ok(velocity)
}

/// Fields that are not kept, in their order.
fn skip_the_rest(r: &mut Cursor<'_>, bits: u32) -> Read<()> {
    let has = |bit: u32| bits & bit != 0;
    if has(bit::BONES) {
        let kind = r.byte()?;
        if kind & 0x80 != 0 {
            let bones = usize::from(r.byte()?);
            r.skip(14 * bones)?;
        }
        if kind & 0x40 != 0 {
            r.skip(3)?;
        }
        if kind & 0x3f != 0 {
            return Err(Fault::Delta);
        }
    }
    if has(bit::DRAW_FLAGS) && r.byte()? & 7 == 7 {
        r.skip(1)?;
    }
    if has(bit::TAG) {
        entity_number(r)?;
        r.skip(1)?;
    }
    if has(bit::LIGHT) {
        r.skip(10)?;
    }
    if has(bit::TRAIL) && r.u16()? & 0x8000 != 0 {
        r.skip(2)?;
    }
    if has(bit::COLOUR) {
        r.skip(3)?;
    }
    if has(bit::GLOW) {
        r.skip(5)?;
    }
    if has(bit::FATNESS) {
        r.skip(1)?;
    }
    if has(bit::MODEL2) {
        r.byte_or_short(has(bit::WIDE))?;
    }
    if has(bit::GRAVITY) {
        r.skip(2)?;
    }
    if has(bit::LERP) {
        r.skip(2)?;
    }
    Ok(())
}
