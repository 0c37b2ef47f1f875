//! What servers say, in the words of the protocol.

use std::fmt;

/// Three numbers: a place in Quake units, or pitch, yaw and roll in degrees.
pub type Vec3 = [f32; 3];

/// Why the rest of a block cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The block ends in the middle of a message.
    End,
    /// A message of this number is unknown.
    Message(u8),
    /// A temporary entity of this number is unknown.
    TempEntity(u8),
    /// An entity number above [`super::MAX_ENTITY`].
    Entity(u32),
    /// More models or sounds than [`super::MAX_PRECACHES`].
    Precaches,
    /// A level without a slot for a player.
    NoPlayers,
    /// A message of a mod of its own that only the mod's code can read.
    GameCode,
    /// An entity's change holds bones or fields of no meaning.
    Delta,
    /// A message comes before any level.
    NoLevel,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::End => write!(f, "the block ends in the middle of a message"),
            Self::Message(id) => write!(f, "message {id} is unknown"),
            Self::TempEntity(id) => write!(f, "temporary entity {id} is unknown"),
            Self::Entity(n) => write!(f, "entity {n} is above {}", super::MAX_ENTITY),
            Self::Precaches => {
                write!(f, "more than {} models or sounds", super::MAX_PRECACHES)
            }
            Self::NoPlayers => write!(f, "a level without a slot for a player"),
            Self::GameCode => write!(f, "a message that only a mod's own code can read"),
            Self::Delta => write!(f, "an entity's change has fields of no known meaning"),
            Self::NoLevel => write!(f, "an entity before any level"),
        }
    }
}

/// An entity as the server describes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EntityState {
    /// Where it is.
    pub origin: Vec3,
    /// Pitch, yaw, roll in degrees; alias models with a positive pitch look up, all else down.
    pub angles: Vec3,
    /// Index of its model, 1 the level; 0 is invisible.
    pub model: u16,
    /// Frame of the model.
    pub frame: u16,
    /// Skin of the model.
    pub skin: u16,
    /// Player whose colours it wears, 1 the first; 0 none.
    pub colormap: u8,
    /// [`super::effect`] flags.
    pub effects: u32,
    /// Opacity as sent: 0 is the default, else `(alpha - 1) / 254`; see [`EntityState::opacity`].
    pub alpha: u8,
    /// Size in sixteenths.
    pub scale: u8,
    /// [`super::entity_flag`] flags.
    pub flags: u8,
    /// Speed in Quake units per second, where it is sent at all (replacement deltas alone).
    pub velocity: Vec3,
}

impl Default for EntityState {
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
            flags: 0,
            velocity: [0.0; 3],
        }
    }
}

impl EntityState {
    /// Opacity, 0 to 1.
    pub fn opacity(&self) -> f32 {
        match self.alpha {
            0 => 1.0,
            a => f32::from(a - 1) / 254.0,
        }
    }
}

/// An entity in the newest message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EntityUpdate {
    /// Its number; 1 up to the number of players are players.
    pub number: u16,
    /// All of it.
    pub state: EntityState,
    /// Seconds after the message's time at which its movement and pose are to be reached.
    pub lerp_finish: Option<f32>,
}

/// What the server tells the recording player about itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClientData {
    /// Height of the eye above the origin.
    pub view_height: f32,
    /// Pitch that the view drifts to.
    pub ideal_pitch: f32,
    /// Kick of the weapon in degrees.
    pub punch: Vec3,
    /// Speed in Quake units per second.
    pub velocity: Vec3,
    /// [`super::item`] flags.
    pub items: u32,
    /// Stands on the ground.
    pub on_ground: bool,
    /// Is in a liquid.
    pub in_water: bool,
    /// Frame of the view model.
    pub weapon_frame: u16,
    /// Armour.
    pub armor: i32,
    /// Index of the view model; 0 none.
    pub weapon: u16,
    /// Health.
    pub health: i32,
    /// Ammunition of the weapon in hand.
    pub ammo: i32,
    /// Shells, nails, rockets, cells.
    pub ammo_counts: [i32; 4],
    /// Number of the weapon in hand.
    pub active_weapon: u8,
    /// Opacity of the view model as sent, like [`EntityState::alpha`].
    pub weapon_alpha: u8,
}

impl Default for ClientData {
    fn default() -> Self {
        Self {
            view_height: 22.0,
            ideal_pitch: 0.0,
            punch: [0.0; 3],
            velocity: [0.0; 3],
            items: 0,
            on_ground: false,
            in_water: false,
            weapon_frame: 0,
            armor: 0,
            weapon: 0,
            health: 100,
            ammo: 0,
            ammo_counts: [0; 4],
            active_weapon: 0,
            weapon_alpha: 0,
        }
    }
}

impl ClientData {
    /// Sets one of the numbered values that servers send by themselves; those not kept here are
    /// ignored.
    pub fn set_stat(&mut self, index: u8, value: f64) {
        let whole = value as i32;
        match index {
            0 => self.health = whole,
            2 => self.weapon = whole.clamp(0, 0xffff) as u16,
            3 => self.ammo = whole,
            4 => self.armor = whole,
            5 => self.weapon_frame = whole.clamp(0, 0xffff) as u16,
            6..=9 => {
                if let Some(count) = self.ammo_counts.get_mut(usize::from(index - 6)) {
                    *count = whole;
                }
            }
            10 => self.active_weapon = whole.clamp(0, 255) as u8,
            // Flags: the sign is a bit like the others.
            15 => self.items = (value as i64) as u32,
            16 => self.view_height = value as f32,
            25 => self.ideal_pitch = value as f32,
            26..=28 => {
                if let Some(punch) = self.punch.get_mut(usize::from(index - 26)) {
                    *punch = value as f32;
                }
            }
            _ => {}
        }
    }
}

/// The beginning of a level.
#[derive(Clone, Debug, PartialEq)]
pub struct ServerInfo<'a> {
    /// 15, 666 or 999.
    pub protocol: i32,
    /// Flags of protocol 999 ([`super::flag`]).
    pub flags: u32,
    /// Extensions of FTE and vkQuake: `FTEX`, `FTE2`.
    pub extensions: [u32; 2],
    /// Slots for players, 1 or more.
    pub max_players: u8,
    /// 0 alone or cooperative, 1 deathmatch.
    pub game_type: u8,
    /// The level's title, in the charset of the game.
    pub level_name: &'a [u8],
    /// Files of models; the first is number 1, the level itself.
    pub models: Vec<&'a [u8]>,
    /// Files of sounds; the first is number 1.
    pub sounds: Vec<&'a [u8]>,
}

/// A short-lived effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TempEntity {
    /// One at a place.
    Point {
        /// What it is.
        kind: PointEffect,
        /// Where.
        at: Vec3,
    },
    /// An explosion in a range of colours.
    ColouredExplosion {
        /// Where.
        at: Vec3,
        /// First palette index.
        first: u8,
        /// Number of colours, 1 or more.
        count: u8,
    },
    /// A bolt or beam.
    Beam {
        /// What it is.
        kind: BeamKind,
        /// Who holds it; a second beam of the same entity replaces the first.
        entity: u16,
        /// From here ...
        start: Vec3,
        /// ... to here.
        end: Vec3,
    },
    /// Rain or snow of other engines, which is not shown.
    Weather,
}

/// Effects at a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PointEffect {
    /// A nail hits a wall.
    Spike,
    /// A large nail hits a wall.
    SuperSpike,
    /// Shot hits a wall.
    Gunshot,
    /// An explosion with light.
    Explosion,
    /// The explosion of a spawn.
    TarExplosion,
    /// A wizard's shot hits a wall.
    WizardSpike,
    /// A knight's shot hits a wall.
    KnightSpike,
    /// Lava splashes.
    LavaSplash,
    /// Somebody teleports.
    Teleport,
}

/// What beams look like.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BeamKind {
    /// `progs/bolt.mdl`
    Lightning1,
    /// `progs/bolt2.mdl`
    Lightning2,
    /// `progs/bolt3.mdl`
    Lightning3,
    /// `progs/beam.mdl`
    Grapple,
}

impl BeamKind {
    /// The model that is laid along it every 30 units.
    pub fn model(self) -> &'static str {
        match self {
            Self::Lightning1 => "progs/bolt.mdl",
            Self::Lightning2 => "progs/bolt2.mdl",
            Self::Lightning3 => "progs/bolt3.mdl",
            Self::Grapple => "progs/beam.mdl",
        }
    }
}

/// What a late addition to the lists of files is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precache {
    /// A model.
    Model,
    /// An effect of a mod.
    Effect,
    /// A sound.
    Sound,
}

/// One message of a server. Entities arrive complete: baselines and changes are resolved.
#[derive(Clone, Debug, PartialEq)]
pub enum Message<'a> {
    /// The recording ends.
    Disconnect,
    /// A numbered value about the player or the level ([`ClientData::set_stat`]).
    Stat(u8, f64),
    /// The camera is this entity from now on.
    SetView(u16),
    /// A sound starts.
    Sound {
        /// Who makes it.
        entity: u16,
        /// Its index among the level's sounds.
        sound: u16,
        /// Where.
        at: Vec3,
    },
    /// A sound stops.
    StopSound(u16),
    /// The server's clock in seconds; what follows is true at that time.
    Time(f32),
    /// Text for the console.
    Print(&'a [u8]),
    /// A command line, possibly in parts.
    StuffText(&'a [u8]),
    /// The view turns to these angles at once.
    SetAngle(Vec3),
    /// The view turns by these angles.
    TurnAngle(Vec3),
    /// A level begins; everything before is forgotten.
    ServerInfo(ServerInfo<'a>),
    /// A light style's letters.
    LightStyle(u8, &'a [u8]),
    /// A player's name.
    Name(u8, &'a [u8]),
    /// A player's frags.
    Frags(u8, i16),
    /// A player's colours: shirt times 16 plus trousers.
    Colours(u8, u8),
    /// About the recording player.
    Client(ClientData),
    /// A burst of particles.
    Particles {
        /// Where.
        at: Vec3,
        /// Where to, in sixteenths of what the game says.
        direction: Vec3,
        /// How many; 1024 is an explosion.
        count: u16,
        /// Palette index.
        colour: u8,
    },
    /// The recording player is hurt.
    Damage {
        /// What armour took.
        armor: u8,
        /// What health took.
        blood: u8,
        /// Where it came from.
        from: Vec3,
    },
    /// An entity that stays for good and never changes.
    Static(EntityState),
    /// What an entity is where updates do not say otherwise.
    Baseline(u16, EntityState),
    /// A short-lived effect.
    TempEntity(TempEntity),
    /// The game is paused, or goes on.
    Pause(bool),
    /// A stage of the connection is done.
    Signon(u8),
    /// Text for the middle of the screen.
    CenterPrint(&'a [u8]),
    /// A monster died.
    KilledMonster,
    /// A secret was found.
    FoundSecret,
    /// A sound that never ends.
    StaticSound {
        /// Its index among the level's sounds.
        sound: u16,
        /// Where.
        at: Vec3,
    },
    /// The level is over; the camera stands.
    Intermission,
    /// The same with text, at the end of an episode.
    Finale(&'a [u8]),
    /// The same, in a scene of a mod.
    Cutscene(&'a [u8]),
    /// The help screen of the unregistered game.
    SellScreen,
    /// Music.
    CdTrack(u8, u8),
    /// The sky's pictures.
    Skybox(&'a [u8]),
    /// The screen flashes for an item.
    BonusFlash,
    /// Fog.
    Fog {
        /// Its density.
        density: f32,
        /// Its colour, 0 to 1.
        colour: Vec3,
        /// Seconds until it is reached.
        seconds: f32,
    },
    /// A prize of the re-release.
    Achievement(&'a [u8]),
    /// A sound of menus.
    LocalSound(u16),
    /// An entity in the newest message.
    Entity(EntityUpdate),
    /// An entity is gone (replacement deltas alone: elsewhere entities are gone that the newest
    /// message does not have).
    Remove(u16),
    /// All entities are gone (replacement deltas alone).
    RemoveAll,
    /// A file is added to the lists of the level.
    Precache(Precache, u16, &'a [u8]),
    /// A numbered text about the player or the level.
    TextStat(u8, &'a [u8]),
    /// An effect or voice of an extension that is not shown.
    Ignored,
}
