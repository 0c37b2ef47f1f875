//! Doom 3's models (`.md5mesh`, `.md5anim`, version 10), as engines read them in the place of alias models: meshes
//! whose vertices hang on the joints of a skeleton, and the skeleton in every frame.
//!
//! Poses are computed when they are asked for: a small file can have very many vertices times frames.

use crate::error::{ErrorKind, FormatError, Limits};
use crate::posed::PosedSurface;

/// Most joints that a vertex may hang on: engines keep 4 or 8, and poses take time for each.
const MAX_SHARES: u32 = 32;
/// The one version there is.
const VERSION: &[u8] = b"10";

/// A model of Doom 3, with its animation.
#[derive(Clone, Debug, PartialEq)]
pub struct Md5 {
    /// The skeleton, parents before children; at least one joint.
    pub joints: Vec<Md5Joint>,
    /// Meshes, at least one.
    pub surfaces: Vec<PosedSurface>,
    /// What of a joint a frame moves; as many as joints, if there are frames.
    pub channels: Vec<Channel>,
    /// The numbers of each frame; none if there is no animation.
    pub frames: Vec<Vec<f32>>,
    /// For each surface, where its vertices hang.
    hung: Vec<Hung>,
}

/// A joint of a skeleton.
#[derive(Clone, Debug, PartialEq)]
pub struct Md5Joint {
    /// Its name.
    pub name: String,
    /// Index of the joint that it hangs on, which comes before it.
    pub parent: Option<usize>,
    /// Where it is when the model stands in no frame, in the model's space.
    pub rest: Placed,
}

/// A rotation and a translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// In Quake units.
    pub position: [f32; 3],
    /// Unit quaternion x, y, z, w.
    pub turn: [f32; 4],
}

/// What of a joint a frame moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channel {
    /// Bits for x, y, z of the position and of the rotation.
    flags: u32,
    /// The first of its numbers in a frame.
    first: usize,
    /// Position and rotation (x, y, z) where the frame says nothing.
    base: [f32; 6],
}

/// The vertices of a surface and the joints they hang on.
#[derive(Clone, Debug, Default, PartialEq)]
struct Hung {
    /// First weight, and how many, of each vertex.
    vertices: Vec<[u32; 2]>,
    /// Joint, share, and place in the joint's space.
    weights: Vec<(u32, f32, [f32; 3])>,
}

impl Md5 {
    /// Reads a model, and its animation where there is one.
    ///
    /// # Errors
    /// Text that is not what it should be, with its byte; another version; counts that the text does not justify;
    /// numbers that are none or beyond [`Limits::max_coordinate`]; indices of joints, weights and vertices that are
    /// not there; an animation of another skeleton or without frames.
    pub fn parse(mesh: &[u8], anim: Option<&[u8]>, limits: &Limits) -> Result<Self, FormatError> {
        let mut model = read_mesh(mesh, limits)?;
        if let Some(anim) = anim {
            read_anim(anim, &mut model, limits)?;
        }
        Ok(model)
    }

    /// Where the vertices of all surfaces are in a frame that is there, or at rest if there is none.
    pub(crate) fn pose(&self, frame: usize) -> Vec<[f32; 3]> {
        let joints: Vec<Placed> = match self.frames.get(frame) {
            None => self.joints.iter().map(|j| j.rest).collect(),
            Some(numbers) => self.posed_joints(numbers),
        };
        let mut places = Vec::new();
        for hung in &self.hung {
            for &[first, count] in &hung.vertices {
                let weights = hung
                    .weights
                    .iter()
                    .skip(first as usize)
                    .take(count as usize);
                let mut place = [0.0_f32; 3];
                for (joint, share, at) in weights {
                    let Some(joint) = joints.get(*joint as usize) else {
                        continue;
                    };
                    for (sum, c) in place.iter_mut().zip(joint.apply(*at)) {
                        *sum += c * share;
                    }
                }
                // Shares that are far from 1 together are an error of the file; numbers they are.
                places.push(place.map(|c| if c.is_finite() { c } else { 0.0 }));
            }
        }
        places
    }

    fn posed_joints(&self, numbers: &[f32]) -> Vec<Placed> {
        let mut placed: Vec<Placed> = Vec::with_capacity(self.joints.len());
        for (joint, channel) in self.joints.iter().zip(&self.channels) {
            let mut values = channel.base;
            let moved =
                (values.iter_mut().enumerate()).filter(|(bit, _)| channel.flags >> bit & 1 != 0);
            let given = numbers.iter().skip(channel.first);
            for ((_, value), number) in moved.zip(given) {
                *value = *number;
            }
            let [x, y, z, a, b, c] = values;
            let own = Placed {
                position: [x, y, z],
                turn: with_w([a, b, c]),
            };
            let parent = joint.parent.and_then(|p| placed.get(p));
            placed.push(parent.map_or(own, |p| p.then(&own)));
        }
        placed
    }
}

impl Placed {
    /// A place in its space as one in the space around it.
    fn apply(&self, p: [f32; 3]) -> [f32; 3] {
        let [x, y, z, w] = self.turn;
        let v = [x, y, z];
        let t = cross(v, p).map(|c| 2.0 * c);
        let u = cross(v, t);
        let [px, py, pz] = self.position;
        let [a, b, c] = p;
        let [ta, tb, tc] = t;
        let [ua, ub, uc] = u;
        [
            a + w * ta + ua + px,
            b + w * tb + ub + py,
            c + w * tc + uc + pz,
        ]
    }

    /// What is placed as `inner` in its space.
    fn then(&self, inner: &Self) -> Self {
        let [ax, ay, az, aw] = self.turn;
        let [bx, by, bz, bw] = inner.turn;
        Self {
            position: self.apply(inner.position),
            turn: [
                aw * bx + ax * bw + ay * bz - az * by,
                aw * by - ax * bz + ay * bw + az * bx,
                aw * bz + ax * by - ay * bx + az * bw,
                aw * bw - ax * bx - ay * by - az * bz,
            ],
        }
    }
}

fn cross([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> [f32; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

/// The unit quaternion of which three numbers are stored; the fourth is not positive.
fn with_w([x, y, z]: [f32; 3]) -> [f32; 4] {
    let left = 1.0 - x * x - y * y - z * z;
    if left >= 0.0 {
        return [x, y, z, -left.sqrt()];
    }
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, y / length, z / length, 0.0]
}

fn read_mesh(data: &[u8], limits: &Limits) -> Result<Md5, FormatError> {
    let mut t = Text::new(data, "MD5 mesh", limits)?;
    t.version()?;
    t.word(b"numJoints")?;
    let joint_count = t.count("joints", 10)?;
    t.word(b"numMeshes")?;
    let mesh_count = t.count("meshes", 10)?;
    t.word(b"joints")?;
    t.word(b"{")?;
    let mut joints: Vec<Md5Joint> = Vec::with_capacity(joint_count);
    for i in 0..joint_count {
        let name = t.next_text("a joint's name")?;
        let parent = t.parent(i)?;
        let position = t.vector()?;
        let turn = with_w(t.vector()?);
        joints.push(Md5Joint {
            name,
            parent,
            rest: Placed { position, turn },
        });
    }
    t.word(b"}")?;
    let mut model = Md5 {
        joints,
        surfaces: Vec::with_capacity(mesh_count),
        channels: Vec::new(),
        frames: Vec::new(),
        hung: Vec::with_capacity(mesh_count),
    };
    for _ in 0..mesh_count {
        t.word(b"mesh")?;
        t.word(b"{")?;
        read_surface(&mut t, &mut model)?;
        t.word(b"}")?;
    }
    Ok(model)
}

fn read_surface(t: &mut Text<'_>, model: &mut Md5) -> Result<(), FormatError> {
    t.word(b"shader")?;
    let name = t.next_text("the shader's name")?;
    t.word(b"numverts")?;
    let vertices = t.count("vertices", 10)?;
    let mut uv = vec![[0.0; 2]; vertices];
    let mut hung = Hung {
        vertices: vec![[0; 2]; vertices],
        weights: Vec::new(),
    };
    let mut ranges = Vec::new();
    while t.is_next(b"vert") {
        let i = t.index("vertex", vertices)?;
        t.word(b"(")?;
        let at = [t.number()?, t.number()?];
        t.word(b")")?;
        let range = [t.whole()?, t.whole()?];
        if range[1] > MAX_SHARES {
            let found = format!("a vertex of {} weights", range[1]);
            return Err(t.error(found, format!("at most {MAX_SHARES}")));
        }
        if let (Some(to), Some(hangs)) = (uv.get_mut(i), hung.vertices.get_mut(i)) {
            *to = at;
            *hangs = range;
        }
        ranges.push((range, t.at));
    }
    t.word(b"numtris")?;
    let count = t.count("triangles", 5)?;
    let mut triangles = vec![[0; 3]; count];
    while t.is_next(b"tri") {
        let i = t.index("triangle", count)?;
        let corners = [
            t.index("vertex", vertices)?,
            t.index("vertex", vertices)?,
            t.index("vertex", vertices)?,
        ];
        if let Some(to) = triangles.get_mut(i) {
            *to = corners.map(|c| c as u32);
        }
    }
    t.word(b"numweights")?;
    let count = t.count("weights", 10)?;
    hung.weights = vec![(0, 0.0, [0.0; 3]); count];
    while t.is_next(b"weight") {
        let i = t.index("weight", count)?;
        let joint = t.index("joint", model.joints.len())?;
        let share = t.number()?;
        let at = t.vector()?;
        if let Some(to) = hung.weights.get_mut(i) {
            *to = (joint as u32, share, at);
        }
    }
    for ([first, n], at) in ranges {
        let end = u64::from(first) + u64::from(n);
        if end > count as u64 {
            let found = format!("weights {first} to {end}");
            return Err(t.error_at(at, found, format!("up to {count}")));
        }
    }
    model.surfaces.push(PosedSurface {
        name,
        uv,
        triangles,
    });
    model.hung.push(hung);
    Ok(())
}

fn read_anim(data: &[u8], model: &mut Md5, limits: &Limits) -> Result<(), FormatError> {
    let mut t = Text::new(data, "MD5 animation", limits)?;
    t.version()?;
    t.word(b"numFrames")?;
    let frame_count = t.count("frames", 8)?;
    t.word(b"numJoints")?;
    let joint_count = t.whole()? as usize;
    if joint_count != model.joints.len() {
        let allowed = format!("{}, as the mesh has", model.joints.len());
        return Err(t.error(format!("{joint_count} joints"), allowed));
    }
    t.word(b"frameRate")?;
    t.number()?;
    t.word(b"numAnimatedComponents")?;
    let numbers = t.whole()? as usize;
    t.word(b"hierarchy")?;
    t.word(b"{")?;
    let mut channels = Vec::with_capacity(joint_count);
    for i in 0..joint_count {
        let name = t.next_text("a joint's name")?;
        let parent = t.parent(i)?;
        let expected = model.joints.get(i);
        if expected.is_none_or(|j| j.name != name || j.parent != parent) {
            let allowed = expected.map_or(String::new(), |j| format!("{:?}", j.name));
            return Err(t.error(
                format!("joint {name:?} on {parent:?}"),
                allowed + " of the mesh",
            ));
        }
        let flags = t.whole()?;
        let first = t.whole()? as usize;
        let used = flags.count_ones() as usize;
        if flags > 63 || first.saturating_add(used) > numbers {
            let found = format!("flags {flags} from number {first} on");
            return Err(t.error(found, format!("0 to 63 within {numbers} numbers")));
        }
        channels.push(Channel {
            flags,
            first,
            base: [0.0; 6],
        });
    }
    t.word(b"}")?;
    t.word(b"bounds")?;
    t.word(b"{")?;
    while !t.is_next(b"}") {
        t.vector()?;
    }
    t.word(b"baseframe")?;
    t.word(b"{")?;
    for channel in &mut channels {
        let [x, y, z] = t.vector()?;
        let [a, b, c] = t.vector()?;
        channel.base = [x, y, z, a, b, c];
    }
    t.word(b"}")?;
    let mut frames: Vec<Option<Vec<f32>>> = vec![None; frame_count];
    while t.is_next(b"frame") {
        let i = t.index("frame", frame_count)?;
        t.word(b"{")?;
        let mut values = Vec::new();
        for _ in 0..numbers {
            values.push(t.number()?);
        }
        t.word(b"}")?;
        if let Some(to) = frames.get_mut(i) {
            *to = Some(values);
        }
    }
    if let Some(missing) = frames.iter().position(Option::is_none) {
        return Err(t.error(
            format!("no frame {missing}"),
            format!("all {frame_count} frames"),
        ));
    }
    model.channels = channels;
    model.frames = frames.into_iter().flatten().collect();
    Ok(())
}

/// The tokens of a text.
struct Text<'a> {
    data: &'a [u8],
    /// Byte of the newest token.
    at: usize,
    /// Where the rest begins.
    next: usize,
    part: &'static str,
    most: f32,
}

impl<'a> Text<'a> {
    fn new(data: &'a [u8], part: &'static str, limits: &Limits) -> Result<Self, FormatError> {
        limits.check_file(data.len() as u64)?;
        Ok(Self {
            data,
            at: 0,
            next: 0,
            part,
            most: limits.max_coordinate,
        })
    }

    fn error_at(
        &self,
        at: usize,
        found: impl Into<String>,
        allowed: impl Into<String>,
    ) -> FormatError {
        FormatError::new(ErrorKind::OutOfRange, self.part, found, allowed).at(at as u64)
    }

    fn error(&self, found: impl Into<String>, allowed: impl Into<String>) -> FormatError {
        self.error_at(self.at, found, allowed)
    }

    /// The next token: a text in quotes, a bracket, or all up to a space or bracket. Empty at the end.
    fn token(&mut self) -> &'a [u8] {
        let byte = |i: usize| self.data.get(i).copied();
        let mut i = self.next;
        loop {
            match (byte(i), byte(i + 1)) {
                (Some(b), _) if b <= b' ' => i += 1,
                (Some(b'/'), Some(b'/')) => {
                    while byte(i).is_some_and(|b| b != b'\n') {
                        i += 1;
                    }
                }
                _ => break,
            }
        }
        self.at = i;
        let is_bracket = |b: u8| matches!(b, b'{' | b'}' | b'(' | b')');
        let (begin, end) = match byte(i) {
            None => (i, i),
            Some(b'"') => {
                let mut end = i + 1;
                while byte(end).is_some_and(|b| b != b'"') {
                    end += 1;
                }
                self.next = end + 1;
                return self.data.get(i + 1..end).unwrap_or_default();
            }
            Some(b) if is_bracket(b) => (i, i + 1),
            Some(_) => {
                let mut end = i;
                while byte(end).is_some_and(|b| b > b' ' && !is_bracket(b) && b != b'"') {
                    end += 1;
                }
                (i, end)
            }
        };
        self.next = end;
        self.data.get(begin..end).unwrap_or_default()
    }

    /// A token for people.
    fn shown(token: &[u8]) -> String {
        if token.is_empty() {
            return "the end of the text".to_owned();
        }
        let short = token.get(..token.len().min(32)).unwrap_or_default();
        format!("{:?}", String::from_utf8_lossy(short))
    }

    fn word(&mut self, wanted: &[u8]) -> Result<(), FormatError> {
        let token = self.token();
        if token == wanted {
            return Ok(());
        }
        Err(self.error(Self::shown(token), Self::shown(wanted)))
    }

    /// Whether the next token is this one, which is then read.
    fn is_next(&mut self, wanted: &[u8]) -> bool {
        let (at, next) = (self.at, self.next);
        let found = self.token() == wanted;
        if !found {
            (self.at, self.next) = (at, next);
        }
        found
    }

    fn version(&mut self) -> Result<(), FormatError> {
        self.word(b"MD5Version")?;
        self.word(VERSION)?;
        if self.is_next(b"commandline") {
            self.token();
        }
        Ok(())
    }

    fn next_text(&mut self, what: &str) -> Result<String, FormatError> {
        let token = self.token();
        if token.is_empty() && self.at >= self.data.len() {
            return Err(self.error(Self::shown(token), what));
        }
        Ok(String::from_utf8_lossy(token).into_owned())
    }

    fn parsed<T: std::str::FromStr>(&mut self, what: &str) -> Result<T, FormatError> {
        let token = self.token();
        let number = std::str::from_utf8(token).ok().and_then(|s| s.parse().ok());
        number.ok_or_else(|| self.error(Self::shown(token), what))
    }

    fn whole(&mut self) -> Result<u32, FormatError> {
        self.parsed("a whole number")
    }

    fn number(&mut self) -> Result<f32, FormatError> {
        let number: f32 = self.parsed("a number")?;
        if number.abs() <= self.most {
            return Ok(number);
        }
        Err(self.error(
            number.to_string(),
            format!("at most {} either way", self.most),
        ))
    }

    fn vector(&mut self) -> Result<[f32; 3], FormatError> {
        self.word(b"(")?;
        let v = [self.number()?, self.number()?, self.number()?];
        self.word(b")")?;
        Ok(v)
    }

    /// A number less than `count`.
    fn index(&mut self, what: &str, count: usize) -> Result<usize, FormatError> {
        let index = self.whole()? as usize;
        if index < count {
            return Ok(index);
        }
        Err(self.error(format!("{what} {index}"), format!("less than {count}")))
    }

    /// How many of something follow, at least one; each takes `each` bytes of text or more.
    fn count(&mut self, what: &str, each: usize) -> Result<usize, FormatError> {
        let count = self.whole()? as usize;
        let most = self.data.len() / each;
        if (1..=most).contains(&count) {
            return Ok(count);
        }
        let allowed = format!("1 to {most} in a text of {} bytes", self.data.len());
        Err(self.error(format!("{count} {what}"), allowed))
    }

    /// The parent of joint `joint`: -1 for none.
    fn parent(&mut self, joint: usize) -> Result<Option<usize>, FormatError> {
        let parent: i64 = self.parsed("a whole number")?;
        match usize::try_from(parent) {
            Err(_) if parent == -1 => Ok(None),
            Ok(parent) if parent < joint => Ok(Some(parent)),
            _ => Err(self.error(
                format!("joint {joint} on {parent}"),
                "-1 or a joint that comes before it",
            )),
        }
    }
}
