//! Demos from scratch: the messages of a server, in any of the protocols that demos come in.
//!
//! The tables are those of the protocol, the code shares nothing with the readers that it is used to
//! test. Values are written as the protocol rounds them.

use std::collections::BTreeMap;

/// Coordinates or angles.
pub type Vec3 = [f32; 3];

/// The language of a server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dialect {
    /// 15, 666 or 999.
    pub protocol: i32,
    /// Flags of protocol 999: how numbers are sent.
    pub flags: u32,
    /// Second set of FTE's extensions: 8 replacement deltas, 0x20 prediction; 0 none.
    pub fte2: u32,
}

impl Dialect {
    /// Protocol 15 without anything.
    pub const QUAKE: Self = Self {
        protocol: 15,
        flags: 0,
        fte2: 0,
    };

    fn deltas(self) -> bool {
        self.fte2 & 8 != 0
    }

    fn predicts(self) -> bool {
        self.fte2 & 0x20 != 0
    }
}

/// An entity as a server sends it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entity {
    /// Where it is.
    pub origin: Vec3,
    /// Pitch, yaw, roll in degrees.
    pub angles: Vec3,
    /// Index of its model, 0 none.
    pub model: u16,
    /// Frame of the model.
    pub frame: u16,
    /// Skin of the model.
    pub skin: u8,
    /// Player whose colours it wears.
    pub colormap: u8,
    /// Glows and flashes.
    pub effects: u8,
    /// Opacity as protocols 666 and 999 code it; 0 the default.
    pub alpha: u8,
    /// Size in sixteenths (protocol 999).
    pub scale: u8,
    /// Moves in steps.
    pub step: bool,
    /// 255ths of a second until its movement is done (protocols 666 and 999).
    pub lerp_finish: Option<u8>,
}

impl Default for Entity {
    fn default() -> Self {
        Self {
            origin: [0.0; 3],
            angles: [0.0; 3],
            model: 0,
            frame: 0,
            skin: 0,
            colormap: 0,
            effects: 0,
            alpha: 0,
            scale: 16,
            step: false,
            lerp_finish: None,
        }
    }
}

/// What a server tells a player about itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Client {
    /// Height of the eye.
    pub view_height: i8,
    /// Kick of the weapon in whole degrees.
    pub punch: [i8; 3],
    /// Speed, in multiples of 16 units per second.
    pub velocity: [i8; 3],
    /// Flags of what the player has.
    pub items: u32,
    /// Stands on the ground.
    pub on_ground: bool,
    /// Frame of the view model.
    pub weapon_frame: u16,
    /// Armour.
    pub armor: u16,
    /// Index of the view model.
    pub weapon: u16,
    /// Health.
    pub health: i16,
}

impl Default for Client {
    fn default() -> Self {
        Self {
            view_height: 22,
            punch: [0; 3],
            velocity: [0; 3],
            items: 0,
            on_ground: true,
            weapon_frame: 0,
            armor: 0,
            weapon: 0,
            health: 100,
        }
    }
}

/// Writes a demo: messages go into the block at hand until [`DemoWriter::end_block`].
pub struct DemoWriter {
    dialect: Dialect,
    file: Vec<u8>,
    block: Vec<u8>,
    baselines: BTreeMap<u16, Entity>,
    /// With replacement deltas: what the other side knows.
    known: BTreeMap<u16, Entity>,
}

impl DemoWriter {
    /// An empty demo; `track` is the CD track to play, -1 none.
    #[must_use]
    pub fn new(dialect: Dialect, track: i32) -> Self {
        Self {
            dialect,
            file: format!("{track}\n").into_bytes(),
            block: Vec::new(),
            baselines: BTreeMap::new(),
            known: BTreeMap::new(),
        }
    }

    /// The whole file. Messages of a block that is not ended are left out.
    #[must_use]
    pub fn finish(self) -> Vec<u8> {
        self.file
    }

    /// Bytes written so far, without the block at hand.
    #[must_use]
    pub fn len(&self) -> usize {
        self.file.len()
    }

    /// Whether nothing has been written; it never is, for the first line always is.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.file.is_empty()
    }

    /// Ends the block: the player looked to `angles` when it arrived.
    pub fn end_block(&mut self, angles: Vec3) {
        self.file.extend((self.block.len() as i32).to_le_bytes());
        for a in angles {
            self.file.extend(a.to_le_bytes());
        }
        self.file.append(&mut self.block);
    }

    /// Any bytes, as they are.
    pub fn raw(&mut self, bytes: &[u8]) -> &mut Self {
        self.block.extend(bytes);
        self
    }

    fn byte(&mut self, value: u8) -> &mut Self {
        self.raw(&[value])
    }

    fn short(&mut self, value: i32) -> &mut Self {
        self.raw(&(value as u16).to_le_bytes())
    }

    fn string(&mut self, text: &str) -> &mut Self {
        self.raw(text.as_bytes()).byte(0)
    }

    fn coord(&mut self, value: f32) -> &mut Self {
        let flags = self.dialect.flags;
        if flags & 0x10 != 0 {
            self.raw(&value.to_le_bytes())
        } else if flags & 0x80 != 0 {
            self.raw(&((value * 16.0).round() as i32).to_le_bytes())
        } else if flags & 8 != 0 {
            let whole = value.floor();
            let part = ((value - whole) * 255.0).round() as u8;
            self.short(whole as i32).byte(part)
        } else {
            self.short((value * 8.0).round() as i32)
        }
    }

    fn coords(&mut self, at: Vec3) -> &mut Self {
        for x in at {
            self.coord(x);
        }
        self
    }

    fn angle(&mut self, degrees: f32) -> &mut Self {
        let flags = self.dialect.flags;
        if flags & 4 != 0 {
            self.raw(&degrees.to_le_bytes())
        } else if flags & 2 != 0 {
            self.short((degrees * 65536.0 / 360.0).round() as i32)
        } else {
            self.byte((degrees * 256.0 / 360.0).round() as i32 as u8)
        }
    }

    /// A level begins; `models[0]` is the level's file.
    pub fn server_info(
        &mut self,
        title: &str,
        max_players: u8,
        models: &[&str],
        sounds: &[&str],
    ) -> &mut Self {
        self.baselines.clear();
        self.known.clear();
        let Dialect {
            protocol,
            flags,
            fte2,
        } = self.dialect;
        self.byte(11);
        if fte2 != 0 {
            self.raw(b"FTE2").raw(&fte2.to_le_bytes());
        }
        self.raw(&protocol.to_le_bytes());
        if protocol == 999 {
            self.raw(&flags.to_le_bytes());
        }
        if fte2 & 0x20 != 0 {
            self.string("id1");
        }
        self.byte(max_players).byte(0).string(title);
        for list in [models, sounds] {
            for name in list {
                self.string(name);
            }
            self.byte(0);
        }
        self
    }

    /// The server's clock. With replacement deltas, entities carry it too.
    pub fn time(&mut self, seconds: f32) -> &mut Self {
        self.byte(7).raw(&seconds.to_le_bytes());
        if self.dialect.predicts() {
            self.short(0);
        }
        self
    }

    /// The stage of the connection.
    pub fn signon(&mut self, stage: u8) -> &mut Self {
        self.byte(25).byte(stage)
    }

    /// The camera is this entity.
    pub fn set_view(&mut self, entity: u16) -> &mut Self {
        self.byte(5).short(i32::from(entity))
    }

    /// The view turns to these angles.
    pub fn set_angle(&mut self, angles: Vec3) -> &mut Self {
        self.byte(10);
        for a in angles {
            self.angle(a);
        }
        self
    }

    /// A light style's letters.
    pub fn light_style(&mut self, style: u8, letters: &str) -> &mut Self {
        self.byte(12).byte(style).string(letters)
    }

    /// A numbered value.
    pub fn stat(&mut self, index: u8, value: i32) -> &mut Self {
        self.byte(3).byte(index).raw(&value.to_le_bytes())
    }

    /// Messages that are a number and a text: print 8, stufftext 9, centerprint 26, finale 31,
    /// cutscene 34, skybox 37.
    pub fn text(&mut self, message: u8, text: &str) -> &mut Self {
        self.byte(message).string(text)
    }

    fn is_large(&self, e: &Entity) -> bool {
        self.dialect.protocol != 15 && (e.model > 255 || e.frame > 255 || e.alpha != 0)
    }

    fn body(&mut self, e: &Entity, large: bool) {
        if large {
            // Large models and frames, alpha, and scale where it is not the default.
            let scaled = e.scale != 16;
            self.byte(7 | u8::from(scaled) << 3);
            self.short(i32::from(e.model)).short(i32::from(e.frame));
        } else {
            self.byte(e.model as u8).byte(e.frame as u8);
        }
        self.byte(e.colormap).byte(e.skin);
        for (origin, angle) in e.origin.into_iter().zip(e.angles) {
            self.coord(origin).angle(angle);
        }
        if large {
            self.byte(e.alpha);
            if e.scale != 16 {
                self.byte(e.scale);
            }
        }
    }

    /// What an entity is where updates do not say otherwise.
    pub fn baseline(&mut self, number: u16, e: &Entity) -> &mut Self {
        if self.dialect.deltas() {
            self.byte(66);
            self.short(i32::from(number));
            self.delta(None, e);
        } else {
            let large = self.is_large(e);
            self.byte(if large { 42 } else { 22 });
            self.short(i32::from(number));
            self.body(e, large);
        }
        self.baselines.insert(number, *e);
        self
    }

    /// An entity that stays for good.
    pub fn spawn_static(&mut self, e: &Entity) -> &mut Self {
        if self.dialect.deltas() {
            self.byte(21);
            self.delta(None, e);
        } else {
            let large = self.is_large(e);
            self.byte(if large { 43 } else { 20 });
            self.body(e, large);
        }
        self
    }

    /// All entities that there are at the time `seconds`, which is written too.
    pub fn frame(&mut self, seconds: f32, entities: &[(u16, Entity)]) -> &mut Self {
        if !self.dialect.deltas() {
            self.time(seconds);
            for (number, e) in entities {
                self.update(*number, e);
            }
            return self;
        }
        self.byte(86);
        if self.dialect.predicts() {
            self.short(0);
        }
        self.raw(&seconds.to_le_bytes());
        let known = std::mem::take(&mut self.known);
        for number in known.keys() {
            if !entities.iter().any(|(n, _)| n == number) {
                self.short(0x8000 | i32::from(*number));
            }
        }
        for (number, e) in entities {
            if known.get(number) != Some(e) {
                self.short(i32::from(*number));
                self.delta(Some((known.get(number), *number)), e);
            }
            self.known.insert(*number, *e);
        }
        self.short(0)
    }

    /// An update by protocols 15, 666 and 999: what differs from the baseline.
    fn update(&mut self, number: u16, e: &Entity) {
        let base = self.baselines.get(&number).copied().unwrap_or_default();
        let extended = self.dialect.protocol != 15;
        let mut bits = 0x80_u32;
        let mut set = |bit: u32, on: bool| bits |= if on { bit } else { 0 };
        for (i, (o, a)) in [(2, 0x100), (4, 0x10), (8, 0x200)].into_iter().enumerate() {
            set(o, e.origin[i] != base.origin[i]);
            set(a, e.angles[i] != base.angles[i]);
        }
        set(0x20, e.step);
        set(0x40, e.frame & 0xff != base.frame & 0xff || e.frame > 255);
        set(0x400, e.model & 0xff != base.model & 0xff || e.model > 255);
        set(0x800, e.colormap != base.colormap);
        set(0x1000, e.skin != base.skin);
        set(0x2000, e.effects != 0);
        set(0x4000, number > 255);
        if extended {
            set(1 << 16, e.alpha != base.alpha);
            set(1 << 17, e.frame >> 8 != base.frame >> 8);
            set(1 << 18, e.model >> 8 != base.model >> 8);
            set(1 << 19, e.lerp_finish.is_some());
            set(1 << 20, e.scale != base.scale);
            if bits >> 16 != 0 {
                bits |= 0x8000;
            }
        }
        if bits >> 8 != 0 {
            bits |= 1;
        }
        self.byte(bits as u8);
        if bits & 1 != 0 {
            self.byte((bits >> 8) as u8);
        }
        if bits & 0x8000 != 0 {
            self.byte((bits >> 16) as u8);
        }
        let has = |bit: u32| bits & bit != 0;
        if has(0x4000) {
            self.short(i32::from(number));
        } else {
            self.byte(number as u8);
        }
        for (bit, value) in [
            (0x400, e.model as u8),
            (0x40, e.frame as u8),
            (0x800, e.colormap),
            (0x1000, e.skin),
            (0x2000, e.effects),
        ] {
            if has(bit) {
                self.byte(value);
            }
        }
        for (i, (o, a)) in [(2, 0x100), (4, 0x10), (8, 0x200)].into_iter().enumerate() {
            if has(o) {
                self.coord(e.origin[i]);
            }
            if has(a) {
                self.angle(e.angles[i]);
            }
        }
        for (bit, value) in [
            (1 << 16, e.alpha),
            (1 << 20, e.scale),
            (1 << 17, (e.frame >> 8) as u8),
            (1 << 18, (e.model >> 8) as u8),
            (1 << 19, e.lerp_finish.unwrap_or(0)),
        ] {
            if has(bit) {
                self.byte(value);
            }
        }
    }

    /// A change by replacement deltas. `of` is what the other side knows of the entity and its
    /// number; `None` starts from nothing, for baselines.
    fn delta(&mut self, of: Option<(Option<&Entity>, u16)>, e: &Entity) {
        let base = match of {
            None => Entity::default(),
            Some((Some(known), _)) => *known,
            Some((None, number)) => self.baselines.get(&number).copied().unwrap_or_default(),
        };
        let wide = e.frame > 255 || e.model > 255;
        let mut bits = 0_u32;
        let mut set = |bit: u32, on: bool| bits |= if on { 1 << bit } else { 0 };
        set(0, e.frame != base.frame);
        set(1, e.origin[..2] != base.origin[..2]);
        set(2, e.origin[2] != base.origin[2]);
        set(
            3,
            e.angles[0] != base.angles[0] || e.angles[2] != base.angles[2],
        );
        set(4, e.angles[1] != base.angles[1]);
        set(5, e.effects != base.effects);
        set(8, matches!(of, Some((None, _))));
        set(9, wide);
        set(10, e.model != base.model);
        set(11, e.skin != base.skin);
        set(12, e.colormap != base.colormap);
        set(14, e.step != base.step);
        set(16, e.alpha != base.alpha);
        set(17, e.scale != base.scale);
        for (bit, above) in [(23, 24), (15, 16), (7, 8)] {
            if bits >> above != 0 {
                bits |= 1 << bit;
            }
        }
        self.byte(bits as u8);
        for (bit, shift) in [(7, 8), (15, 16), (23, 24)] {
            if bits >> bit & 1 != 0 {
                self.byte((bits >> shift) as u8);
            }
        }
        let has = |bit: u32| bits >> bit & 1 != 0;
        let number = |this: &mut Self, value: u16| {
            if wide {
                this.short(i32::from(value));
            } else {
                this.byte(value as u8);
            }
        };
        if has(0) {
            number(self, e.frame);
        }
        if has(1) {
            self.coord(e.origin[0]).coord(e.origin[1]);
        }
        if has(2) {
            self.coord(e.origin[2]);
        }
        if has(3) {
            self.angle(e.angles[0]).angle(e.angles[2]);
        }
        if has(4) {
            self.angle(e.angles[1]);
        }
        if has(5) {
            self.byte(e.effects);
        }
        if has(10) {
            number(self, e.model);
        }
        if has(11) {
            number(self, u16::from(e.skin));
        }
        if has(12) {
            self.byte(e.colormap);
        }
        if has(14) {
            self.byte(u8::from(e.step));
        }
        if has(16) {
            self.byte(e.alpha.wrapping_sub(1));
        }
        if has(17) {
            self.byte(e.scale);
        }
    }

    /// The player's own data.
    pub fn client(&mut self, c: &Client) -> &mut Self {
        let mut bits = 0x200_u32;
        let mut set = |bit: u32, on: bool| bits |= if on { 1 << bit } else { 0 };
        set(0, c.view_height != 22);
        for i in 0..3 {
            set(2 + i, c.punch[i as usize] != 0);
            set(5 + i, c.velocity[i as usize] != 0);
        }
        set(10, c.on_ground);
        set(12, c.weapon_frame & 0xff != 0);
        set(13, c.armor & 0xff != 0);
        set(14, c.weapon & 0xff != 0);
        if self.dialect.protocol != 15 {
            set(16, c.weapon > 255);
            set(17, c.armor > 255);
            set(24, c.weapon_frame > 255);
            for (bit, above) in [(23, 24), (15, 16)] {
                if bits >> above != 0 {
                    bits |= 1 << bit;
                }
            }
        }
        let has = |bit: u32| bits >> bit & 1 != 0;
        self.byte(15).short((bits & 0xffff) as i32);
        if has(15) {
            self.byte((bits >> 16) as u8);
        }
        if has(23) {
            self.byte((bits >> 24) as u8);
        }
        if has(0) {
            self.byte(c.view_height as u8);
        }
        for i in 0..3 {
            if has(2 + i) {
                self.byte(c.punch[i as usize] as u8);
            }
            if has(5 + i) {
                self.byte(c.velocity[i as usize] as u8);
            }
        }
        self.raw(&c.items.to_le_bytes());
        for (bit, value) in [
            (12, c.weapon_frame as u8),
            (13, c.armor as u8),
            (14, c.weapon as u8),
        ] {
            if has(bit) {
                self.byte(value);
            }
        }
        self.short(i32::from(c.health));
        // Ammunition: that of the weapon, four kinds, and the weapon's number.
        self.raw(&[25, 25, 0, 0, 0, 1]);
        for (bit, value) in [
            (16, c.weapon >> 8),
            (17, c.armor >> 8),
            (24, c.weapon_frame >> 8),
        ] {
            if has(bit) {
                self.byte(value as u8);
            }
        }
        self
    }

    /// A burst of particles; the direction is in sixteenths, the count 255 stands for an explosion.
    pub fn particles(&mut self, at: Vec3, direction: [i8; 3], count: u8, colour: u8) -> &mut Self {
        self.byte(18).coords(at);
        self.raw(&direction.map(|d| d as u8))
            .byte(count)
            .byte(colour)
    }

    /// The player is hurt.
    pub fn damage(&mut self, armor: u8, blood: u8, from: Vec3) -> &mut Self {
        self.byte(19).byte(armor).byte(blood).coords(from)
    }

    /// A temporary entity at a place, by its number.
    pub fn effect(&mut self, number: u8, at: Vec3) -> &mut Self {
        self.byte(23).byte(number).coords(at)
    }

    /// An explosion in a range of colours.
    pub fn coloured_explosion(&mut self, at: Vec3, first: u8, count: u8) -> &mut Self {
        self.effect(12, at).byte(first).byte(count)
    }

    /// A beam (temporary entities 5, 6, 9, 13).
    pub fn beam(&mut self, number: u8, entity: u16, start: Vec3, end: Vec3) -> &mut Self {
        self.byte(23).byte(number).short(i32::from(entity));
        self.coords(start).coords(end)
    }

    /// The level is over.
    pub fn intermission(&mut self) -> &mut Self {
        self.byte(30)
    }

    /// Fog; density and colour 0 to 255, time in hundredths of a second.
    pub fn fog(&mut self, density: u8, colour: [u8; 3], hundredths: i16) -> &mut Self {
        self.byte(41).byte(density).raw(&colour);
        self.short(i32::from(hundredths))
    }

    /// The sky's pictures; no name is the level's own sky.
    pub fn skybox(&mut self, name: &str) -> &mut Self {
        self.byte(37).raw(name.as_bytes()).byte(0)
    }

    /// The recording ends.
    pub fn disconnect(&mut self) -> &mut Self {
        self.byte(2)
    }
}
