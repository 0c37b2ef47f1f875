//! Entity text: `{ "key" "value" ... }` blocks, with getters for the kinds of values that level
//! designers and tools write.

use std::sync::Arc;

use crate::error::{ErrorKind, FormatError, Limits, WarningKind, Warnings};

/// Numbers beyond this are taken for garbage.
const MAX_NUMBER: f64 = 1.0e6;

#[derive(Clone, Copy, Debug)]
struct Span {
    start: u32,
    end: u32,
}

#[derive(Clone, Copy, Debug)]
struct Pair {
    key: Span,
    value: Span,
}

/// One entity: its keys and values in file order. Cheap to clone beside its text, which all
/// entities of a level share.
#[derive(Clone)]
pub struct Entity {
    raw: Arc<[u8]>,
    /// `raw` with bit 7 of each byte stripped: same offsets, always ASCII.
    text: Arc<str>,
    pairs: Box<[Pair]>,
}

impl std::fmt::Debug for Entity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_map().entries(self.iter()).finish()
    }
}

impl Entity {
    /// The value of `key` as display text (bit 7 of each byte stripped, as engines print it). The
    /// key is compared exactly first, then without regard to case; of duplicates the last wins.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.find(key).map(|pair| self.text_of(pair.value))
    }

    /// The value of `key` as the bytes of the file, found as [`Entity::get`] does.
    pub fn get_raw(&self, key: &str) -> Option<&[u8]> {
        self.find(key).map(|pair| self.raw_of(pair.value))
    }

    /// The value of `key`, or of `_key` if there is none: tools and engines accept both for sky,
    /// fog, alpha and light keys.
    pub fn get_loose(&self, key: &str) -> Option<&str> {
        self.get(key).or_else(|| self.get(&format!("_{key}")))
    }

    /// The value of the first of `keys` that there is, each also with a leading `_`.
    pub fn get_any(&self, keys: &[&str]) -> Option<&str> {
        keys.iter().find_map(|key| self.get_loose(key))
    }

    /// Keys and values as display text, in file order, duplicates included.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.pairs
            .iter()
            .map(|pair| (self.text_of(pair.key), self.text_of(pair.value)))
    }

    /// Number of pairs, duplicates included.
    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    /// Whether there is no pair at all.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// The class name; empty if there is none (only the first entity can lack it).
    pub fn classname(&self) -> &str {
        self.get("classname").unwrap_or_default()
    }

    /// A number, read as C's `atof` does (see [`atof`]). `None` if the key is absent or the number
    /// is not finite or beyond a million.
    pub fn float(&self, key: &str) -> Option<f32> {
        parse_float(self.get(key)?)
    }

    /// Like [`Entity::float`], of `key` or `_key`.
    pub fn float_loose(&self, key: &str) -> Option<f32> {
        parse_float(self.get_loose(key)?)
    }

    /// A whole number: [`Entity::float`] with its fraction cut off.
    pub fn int(&self, key: &str) -> Option<i32> {
        self.float(key).map(|v| v as i32)
    }

    /// Three numbers; missing or unusable components are 0. `None` if the key is absent.
    pub fn vec3(&self, key: &str) -> Option<[f32; 3]> {
        Some(parse_vec3(self.get(key)?))
    }

    /// Like [`Entity::vec3`], of `key` or `_key`.
    pub fn vec3_loose(&self, key: &str) -> Option<[f32; 3]> {
        Some(parse_vec3(self.get_loose(key)?))
    }

    /// All numbers of a value, up to `max`; unusable ones are 0. Empty if the key is absent.
    pub fn floats(&self, key: &str, max: usize) -> Vec<f32> {
        self.get(key).map_or_else(Vec::new, |v| {
            numbers(v).take(max).map(|n| n.unwrap_or(0.0)).collect()
        })
    }

    /// Where the entity is, in Quake units; the origin of the level if it does not say.
    pub fn origin(&self) -> [f32; 3] {
        self.vec3("origin").unwrap_or_default()
    }

    /// Pitch, yaw and roll in degrees from `angles`, or from `angle` N as `0 N 0`; of both the one
    /// written last, as engines do. The special values -1 (up) and -2 (down) of `angle` come as
    /// that yaw: use [`Entity::move_direction`] for classes that know them.
    pub fn angles_deg(&self) -> Option<[f32; 3]> {
        let at = |key: &str| {
            self.pairs
                .iter()
                .rposition(|p| self.raw_of(p.key).eq_ignore_ascii_case(key.as_bytes()))
        };
        match (at("angles"), at("angle")) {
            (None, None) => None,
            (Some(_), None) => self.vec3("angles"),
            (a, b) if a > b => self.vec3("angles"),
            _ => Some([0.0, self.float("angle").unwrap_or(0.0), 0.0]),
        }
    }

    /// Unit direction of movement as doors and buttons read it: straight up for an angle of -1,
    /// down for -2, else forward of the angles (positive pitch looks down).
    pub fn move_direction(&self) -> [f32; 3] {
        let angles = self.angles_deg().unwrap_or_default();
        let [pitch, yaw, _] = angles;
        if angles == [0.0, -1.0, 0.0] {
            return [0.0, 0.0, 1.0];
        }
        if angles == [0.0, -2.0, 0.0] {
            return [0.0, 0.0, -1.0];
        }
        let (sp, cp) = f64::from(pitch).to_radians().sin_cos();
        let (sy, cy) = f64::from(yaw).to_radians().sin_cos();
        [(cp * cy) as f32, (cp * sy) as f32, -sp as f32]
    }

    /// The `spawnflags` bits; 0 if there are none or they are no number.
    pub fn spawnflags(&self) -> u32 {
        self.get("spawnflags").map_or(0, |text| {
            let v = atof(text);
            if v.is_finite() { v as i64 as u32 } else { 0 }
        })
    }

    /// N of a brush model reference `"model" "*N"`. `None` if `model` is absent, names a file, or
    /// N is no number; whether the level has that model is for the caller to check.
    pub fn brush_model(&self) -> Option<usize> {
        self.get("model")?.strip_prefix('*')?.parse().ok()
    }

    fn find(&self, key: &str) -> Option<Pair> {
        let key = key.as_bytes();
        let mut pairs = self.pairs.iter().rev();
        pairs
            .clone()
            .find(|p| self.raw_of(p.key) == key)
            .or_else(|| pairs.find(|p| self.raw_of(p.key).eq_ignore_ascii_case(key)))
            .copied()
    }

    fn raw_of(&self, span: Span) -> &[u8] {
        self.raw
            .get(span.start as usize..span.end as usize)
            .unwrap_or_default()
    }

    fn text_of(&self, span: Span) -> &str {
        self.text
            .get(span.start as usize..span.end as usize)
            .unwrap_or_default()
    }
}

fn parse_float(text: &str) -> Option<f32> {
    usable(atof(text))
}

fn usable(v: f64) -> Option<f32> {
    (v.abs() <= MAX_NUMBER).then_some(v as f32)
}

fn parse_vec3(text: &str) -> [f32; 3] {
    let mut out = [0.0; 3];
    for (to, from) in out.iter_mut().zip(numbers(text)) {
        *to = from.unwrap_or(0.0);
    }
    out
}

/// The numbers of a text that are separated by whitespace; `None` for an unusable one.
pub fn numbers(text: &str) -> impl Iterator<Item = Option<f32>> {
    text.split_ascii_whitespace().map(parse_float)
}

/// Reads a number as C's `atof` does: leading whitespace and a sign are taken, the longest prefix
/// that is a number counts (`1.`, `.5`, `+1`, `1e3`), what follows is ignored, and no number is 0.
/// May be infinite for absurd exponents; never NaN, since `nan` and `inf` are no numbers here.
pub fn atof(text: &str) -> f64 {
    let bytes = text.trim_ascii_start().as_bytes();
    let digits = |from: usize| {
        bytes
            .iter()
            .skip(from)
            .take_while(|b| b.is_ascii_digit())
            .count()
    };
    let is = |at: usize, set: &[u8]| bytes.get(at).is_some_and(|b| set.contains(b));
    let sign = usize::from(is(0, b"+-"));
    let whole = digits(sign);
    let mut end = sign + whole;
    let mut fraction = 0;
    if is(end, b".") {
        fraction = digits(end + 1);
        if whole + fraction > 0 {
            end += 1 + fraction;
        }
    }
    if whole + fraction == 0 {
        return 0.0;
    }
    if is(end, b"eE") {
        let exponent_sign = usize::from(is(end + 1, b"+-"));
        let exponent = digits(end + 1 + exponent_sign);
        if exponent > 0 {
            end += 1 + exponent_sign + exponent;
        }
    }
    bytes
        .get(..end)
        .and_then(|b| std::str::from_utf8(b).ok())
        .and_then(|s| s.parse().ok())
        .unwrap_or(0.0)
}

/// Display text with the escapes of the game's string loader resolved: `\n` is a new line, any
/// other `\x` a backslash; `\b`, a tool's switch of text colour, vanishes.
pub fn unescape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        if c != '\\' {
            out.push(c);
            continue;
        }
        match chars.next() {
            Some('n') => out.push('\n'),
            Some('b') => {}
            _ => out.push('\\'),
        }
    }
    out
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TokenKind {
    Open,
    Close,
    Word,
}

struct Lexer<'a> {
    text: &'a [u8],
    pos: usize,
    unterminated: bool,
}

impl Lexer<'_> {
    fn peek(&self, ahead: usize) -> Option<u8> {
        self.text.get(self.pos.checked_add(ahead)?).copied()
    }

    fn skip_while(&mut self, f: impl Fn(u8) -> bool) {
        while self.peek(0).is_some_and(&f) {
            self.pos += 1;
        }
    }

    /// Skips bytes up to 32 and comments.
    fn skip_space(&mut self) {
        loop {
            self.skip_while(|b| b <= b' ');
            match (self.peek(0), self.peek(1)) {
                (Some(b'/'), Some(b'/')) => self.skip_while(|b| b != b'\n'),
                (Some(b'/'), Some(b'*')) => {
                    self.pos += 2;
                    while self.pos < self.text.len()
                        && (self.peek(0), self.peek(1)) != (Some(b'*'), Some(b'/'))
                    {
                        self.pos += 1;
                    }
                    self.pos = (self.pos + 2).min(self.text.len());
                }
                _ => return,
            }
        }
    }

    fn next(&mut self) -> Option<(TokenKind, Span)> {
        self.skip_space();
        let first = self.peek(0)?;
        let mut start = self.pos;
        let mut kind = TokenKind::Word;
        if first == b'"' {
            start += 1;
            self.pos += 1;
            self.skip_while(|b| b != b'"');
            let end = self.pos;
            if self.peek(0).is_some() {
                self.pos += 1;
            } else {
                self.unterminated = true;
            }
            return Some((kind, span(start, end)?));
        }
        if is_punctuation(first) {
            self.pos += 1;
            kind = match first {
                b'{' => TokenKind::Open,
                b'}' => TokenKind::Close,
                _ => TokenKind::Word,
            };
        } else {
            self.skip_while(|b| b > b' ' && !is_punctuation(b));
        }
        Some((kind, span(start, self.pos)?))
    }
}

fn is_punctuation(b: u8) -> bool {
    matches!(b, b'{' | b'}' | b'(' | b')' | b'\'')
}

fn span(start: usize, end: usize) -> Option<Span> {
    Some(Span {
        start: u32::try_from(start).ok()?,
        end: u32::try_from(end).ok()?,
    })
}

/// Parses entity text up to its first NUL or its end. The first entity is worldspawn whatever it
/// says; a later one without a class name is left out with a warning. Malformed text never fails:
/// what could be read before the fault is kept, with a warning.
///
/// # Errors
/// [`ErrorKind::TooLarge`] if the text is longer than [`Limits::max_entity_bytes`].
pub fn parse(
    text: &[u8],
    limits: &Limits,
    warnings: &mut Warnings,
) -> Result<Vec<Entity>, FormatError> {
    let text = text.split(|&b| b == 0).next().unwrap_or_default();
    if text.len() > limits.max_entity_bytes || u32::try_from(text.len()).is_err() {
        return Err(FormatError::new(
            ErrorKind::TooLarge,
            "entity text",
            format!("{} bytes", text.len()),
            format!("at most {}", limits.max_entity_bytes),
        ));
    }
    let display: String = text.iter().map(|b| char::from(b & 0x7f)).collect();
    let raw: Arc<[u8]> = text.into();
    let display: Arc<str> = display.into();
    let mut syntax = |at: usize, what: &str| {
        warnings.add(WarningKind::EntitySyntax, what, || {
            format!("entity text at byte {at}: {what}")
        });
    };

    let mut lexer = Lexer {
        text: &raw,
        pos: 0,
        unterminated: false,
    };
    let mut entities: Vec<Entity> = Vec::new();
    let mut pairs: Vec<Pair> = Vec::new();
    let mut open = false;
    let mut nameless = 0_u64;
    let mut finish = |pairs: &mut Vec<Pair>| {
        let entity = Entity {
            raw: raw.clone(),
            text: display.clone(),
            pairs: pairs.as_slice().into(),
        };
        pairs.clear();
        if entities.is_empty() || entity.find("classname").is_some() {
            entities.push(entity);
        } else {
            nameless += 1;
        }
    };
    while let Some((kind, token)) = lexer.next() {
        let at = token.start as usize;
        match (kind, open) {
            (TokenKind::Open, false) => open = true,
            (TokenKind::Open, true) => {
                syntax(at, "an entity begins before the last one ended");
                finish(&mut pairs);
            }
            (TokenKind::Close, true) => {
                finish(&mut pairs);
                open = false;
            }
            (TokenKind::Close, false) => syntax(at, "a closing brace without an opening one"),
            (TokenKind::Word, false) => syntax(at, "text outside of an entity"),
            (TokenKind::Word, true) => {
                let before = lexer.pos;
                match lexer.next() {
                    Some((TokenKind::Word, value)) => pairs.push(Pair {
                        key: trim_key(&raw, token),
                        value,
                    }),
                    Some(_) => {
                        syntax(at, "a key without a value");
                        lexer.pos = before;
                    }
                    None => syntax(at, "a key without a value"),
                }
            }
        }
    }
    if lexer.unterminated {
        syntax(raw.len(), "a quoted string without its end");
    }
    if open {
        syntax(raw.len(), "the last entity has no closing brace");
        if !pairs.is_empty() {
            finish(&mut pairs);
        }
    }
    warnings.add_many(WarningKind::EntityDropped, "classname", nameless, || {
        "an entity without a classname was left out".to_owned()
    });
    entities.shrink_to_fit();
    Ok(entities)
}

/// A key without its trailing spaces.
fn trim_key(raw: &[u8], key: Span) -> Span {
    let bytes = raw
        .get(key.start as usize..key.end as usize)
        .unwrap_or_default();
    let spaces = bytes.iter().rev().take_while(|&&b| b == b' ').count();
    Span {
        start: key.start,
        end: key.end - u32::try_from(spaces).unwrap_or(0),
    }
}
