//! Entities, baselines and the player's own data as protocols 15, 666 and 999 send them.

use super::cursor::{Cursor, Read};
use super::message::{ClientData, EntityState, EntityUpdate};

/// Bits of an entity's update.
mod bit {
    pub const MORE: u32 = 1;
    pub const ORIGIN: [u32; 3] = [1 << 1, 1 << 2, 1 << 3];
    pub const ANGLE: [u32; 3] = [1 << 8, 1 << 4, 1 << 9];
    pub const STEP: u32 = 1 << 5;
    pub const FRAME: u32 = 1 << 6;
    pub const MODEL: u32 = 1 << 10;
    pub const COLORMAP: u32 = 1 << 11;
    pub const SKIN: u32 = 1 << 12;
    pub const EFFECTS: u32 = 1 << 13;
    pub const LONG_ENTITY: u32 = 1 << 14;
    pub const EXTEND1: u32 = 1 << 15;
    pub const ALPHA: u32 = 1 << 16;
    pub const FRAME2: u32 = 1 << 17;
    pub const MODEL2: u32 = 1 << 18;
    pub const LERP_FINISH: u32 = 1 << 19;
    pub const SCALE: u32 = 1 << 20;
    pub const EXTEND2: u32 = 1 << 23;
}

/// Bits of a baseline of the second kind.
pub mod baseline_bit {
    pub const LARGE_MODEL: u8 = 1;
    pub const LARGE_FRAME: u8 = 2;
    pub const ALPHA: u8 = 4;
    pub const SCALE: u8 = 8;
}

/// A baseline or a static entity, without its number.
pub fn baseline(r: &mut Cursor<'_>, bits: u8) -> Read<EntityState> {
    let has = |bit| bits & bit != 0;
    let mut state = EntityState {
        model: r.byte_or_short(has(baseline_bit::LARGE_MODEL))?,
        frame: r.byte_or_short(has(baseline_bit::LARGE_FRAME))?,
        colormap: r.byte()?,
        skin: u16::from(r.byte()?),
        ..EntityState::default()
    };
    for (origin, angle) in state.origin.iter_mut().zip(&mut state.angles) {
        *origin = r.coord()?;
        *angle = r.angle()?;
    }
    if has(baseline_bit::ALPHA) {
        state.alpha = r.byte()?;
    }
    if has(baseline_bit::SCALE) {
        state.scale = r.byte()?;
    }
    Ok(state)
}

/// The head of an update: its bits and the entity's number. `low` is what the message's number has
/// of the bits.
pub fn update_head(r: &mut Cursor<'_>, low: u8, extended: bool) -> Read<(u32, u16)> {
    let mut bits = u32::from(low);
    if bits & bit::MORE != 0 {
        bits |= u32::from(r.byte()?) << 8;
    }
    if extended && bits & bit::EXTEND1 != 0 {
        bits |= u32::from(r.byte()?) << 16;
        if bits & bit::EXTEND2 != 0 {
            bits |= u32::from(r.byte()?) << 24;
        }
    }
    let number = r.byte_or_short(bits & bit::LONG_ENTITY != 0)?;
    Ok((bits, number))
}

/// The rest of an update: what is not sent is as in the baseline.
pub fn update(
    r: &mut Cursor<'_>,
    (bits, number): (u32, u16),
    baseline: &EntityState,
    extended: bool,
) -> Read<EntityUpdate> {
    let has = |bit| bits & bit != 0;
    let mut state = EntityState {
        effects: 0,
        flags: if has(bit::STEP) {
            super::entity_flag::STEP
        } else {
            0
        },
        ..*baseline
    };
    if has(bit::MODEL) {
        state.model = u16::from(r.byte()?);
    }
    if has(bit::FRAME) {
        state.frame = u16::from(r.byte()?);
    }
    if has(bit::COLORMAP) {
        state.colormap = r.byte()?;
    }
    if has(bit::SKIN) {
        state.skin = u16::from(r.byte()?);
    }
    if has(bit::EFFECTS) {
        state.effects = u32::from(r.byte()?);
    }
    let places = state.origin.iter_mut().zip(&mut state.angles);
    for ((origin, angle), (o, a)) in places.zip(bit::ORIGIN.into_iter().zip(bit::ANGLE)) {
        if has(o) {
            *origin = r.coord()?;
        }
        if has(a) {
            *angle = r.angle()?;
        }
    }
    let mut lerp_finish = None;
    if extended {
        if has(bit::ALPHA) {
            state.alpha = r.byte()?;
        }
        if has(bit::SCALE) {
            state.scale = r.byte()?;
        }
        if has(bit::FRAME2) {
            state.frame = state.frame & 0xff | u16::from(r.byte()?) << 8;
        }
        if has(bit::MODEL2) {
            state.model = state.model & 0xff | u16::from(r.byte()?) << 8;
        }
        if has(bit::LERP_FINISH) {
            lerp_finish = Some(f32::from(r.byte()?) / 255.0);
        }
    } else if has(bit::EXTEND1) {
        // Nehahra's extension of protocol 15.
        let kind = r.float()?;
        state.alpha = nehahra_alpha(r.float()?);
        if kind == 2.0 {
            r.float()?; // full brightness
        }
    }
    Ok(EntityUpdate {
        number,
        state,
        lerp_finish,
    })
}

/// Opacity as later protocols code it.
fn nehahra_alpha(alpha: f32) -> u8 {
    if alpha == 0.0 {
        return 0;
    }
    (alpha * 254.0 + 1.0).round().clamp(1.0, 255.0) as u8
}

/// The player's own data.
pub fn client_data(r: &mut Cursor<'_>) -> Read<ClientData> {
    const VIEW_HEIGHT: u32 = 1;
    const IDEAL_PITCH: u32 = 1 << 1;
    const PUNCH: u32 = 1 << 2;
    const VELOCITY: u32 = 1 << 5;
    const ON_GROUND: u32 = 1 << 10;
    const IN_WATER: u32 = 1 << 11;
    const WEAPON_FRAME: u32 = 1 << 12;
    const ARMOR: u32 = 1 << 13;
    const WEAPON: u32 = 1 << 14;
    const EXTEND1: u32 = 1 << 15;
    const EXTEND2: u32 = 1 << 23;

    let mut bits = u32::from(r.u16()?);
    if bits & EXTEND1 != 0 {
        bits |= u32::from(r.byte()?) << 16;
    }
    if bits & EXTEND2 != 0 {
        bits |= u32::from(r.byte()?) << 24;
    }
    let has = |bit: u32| bits & bit != 0;
    let mut data = ClientData {
        on_ground: has(ON_GROUND),
        in_water: has(IN_WATER),
        ..ClientData::default()
    };
    if has(VIEW_HEIGHT) {
        data.view_height = f32::from(r.char()?);
    }
    if has(IDEAL_PITCH) {
        data.ideal_pitch = f32::from(r.char()?);
    }
    for (i, (punch, velocity)) in data.punch.iter_mut().zip(&mut data.velocity).enumerate() {
        if has(PUNCH << i) {
            *punch = f32::from(r.char()?);
        }
        if has(VELOCITY << i) {
            *velocity = f32::from(r.char()?) * 16.0;
        }
    }
    data.items = r.ulong()?;
    if has(WEAPON_FRAME) {
        data.weapon_frame = u16::from(r.byte()?);
    }
    if has(ARMOR) {
        data.armor = i32::from(r.byte()?);
    }
    if has(WEAPON) {
        data.weapon = u16::from(r.byte()?);
    }
    data.health = i32::from(r.short()?);
    data.ammo = i32::from(r.byte()?);
    for count in &mut data.ammo_counts {
        *count = i32::from(r.byte()?);
    }
    data.active_weapon = r.byte()?;
    high_parts(r, bits, &mut data)?;
    Ok(data)
}

/// The second bytes that protocols 666 and 999 send of what had one.
fn high_parts(r: &mut Cursor<'_>, bits: u32, data: &mut ClientData) -> Read<()> {
    const WEAPON: u32 = 1 << 16;
    const ARMOR: u32 = 1 << 17;
    const AMMO: u32 = 1 << 18;
    const AMMO_COUNTS: u32 = 1 << 19;
    const WEAPON_FRAME: u32 = 1 << 24;
    const WEAPON_ALPHA: u32 = 1 << 25;
    let mut high = |bit: u32| -> Read<u16> {
        Ok(if bits & bit != 0 {
            u16::from(r.byte()?) << 8
        } else {
            0
        })
    };
    data.weapon |= high(WEAPON)?;
    data.armor |= i32::from(high(ARMOR)?);
    data.ammo |= i32::from(high(AMMO)?);
    for (i, count) in data.ammo_counts.iter_mut().enumerate() {
        *count |= i32::from(high(AMMO_COUNTS << i)?);
    }
    data.weapon_frame |= high(WEAPON_FRAME)?;
    if bits & WEAPON_ALPHA != 0 {
        data.weapon_alpha = r.byte()?;
    }
    Ok(())
}
