//! Temporary entities.

use super::cursor::{Cursor, Read};
use super::message::{BeamKind, Fault, PointEffect, TempEntity};

/// A temporary entity with its number.
pub fn temp_entity(r: &mut Cursor<'_>) -> Read<TempEntity> {
    let id = r.byte()?;
    let kind = match id {
        0 => PointEffect::Spike,
        1 => PointEffect::SuperSpike,
        2 => PointEffect::Gunshot,
        3 => PointEffect::Explosion,
        4 => PointEffect::TarExplosion,
        7 => PointEffect::WizardSpike,
        8 => PointEffect::KnightSpike,
        10 => PointEffect::LavaSplash,
        11 => PointEffect::Teleport,
        5 => return beam(r, BeamKind::Lightning1),
        6 => return beam(r, BeamKind::Lightning2),
        9 => return beam(r, BeamKind::Lightning3),
        13 => return beam(r, BeamKind::Grapple),
        12 => {
            return Ok(TempEntity::ColouredExplosion {
                at: r.coords()?,
                first: r.byte()?,
                count: r.byte()?.max(1),
            });
        }
        55 | 56 => {
            for _ in 0..3 {
                r.coords()?;
            }
            r.skip(3)?;
            return Ok(TempEntity::Weather);
        }
        _ => return Err(Fault::TempEntity(id)),
    };
    Ok(TempEntity::Point {
        kind,
        at: r.coords()?,
    })
}

fn beam(r: &mut Cursor<'_>, kind: BeamKind) -> Read<TempEntity> {
    Ok(TempEntity::Beam {
        kind,
        entity: r.u16()?,
        start: r.coords()?,
        end: r.coords()?,
    })
}
