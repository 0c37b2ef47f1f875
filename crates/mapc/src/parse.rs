//! The text of `.map` files: the classic format, and Valve 220.

use crate::CompileError;
use crate::map::{Brush, BrushFace, Entity, Map, Projection};
use crate::math::Vec3;

struct Lexer<'a> {
    text: &'a str,
    at: usize,
    line: usize,
}

#[derive(Debug, PartialEq, Clone, Copy)]
enum Token<'a> {
    Quoted(&'a str),
    Word(&'a str),
}

impl<'a> Lexer<'a> {
    fn error(&self, problem: impl Into<String>) -> CompileError {
        CompileError::Parse {
            line: self.line,
            problem: problem.into(),
        }
    }

    fn next(&mut self) -> Result<Option<Token<'a>>, CompileError> {
        let bytes = self.text.as_bytes();
        loop {
            match bytes.get(self.at) {
                None => return Ok(None),
                Some(b'\n') => {
                    self.line += 1;
                    self.at += 1;
                }
                Some(c) if *c <= b' ' => self.at += 1,
                Some(b'/') if bytes.get(self.at + 1) == Some(&b'/') => {
                    while bytes.get(self.at).is_some_and(|c| *c != b'\n') {
                        self.at += 1;
                    }
                }
                Some(_) => break,
            }
        }
        let start = self.at;
        if bytes[start] == b'"' {
            let rest = &self.text[start + 1..];
            let end = rest
                .find('"')
                .ok_or_else(|| self.error("a quote is not closed"))?;
            self.at = start + 1 + end + 1;
            self.line += rest[..end].matches('\n').count();
            return Ok(Some(Token::Quoted(&rest[..end])));
        }
        while bytes.get(self.at).is_some_and(|c| *c > b' ') {
            self.at += 1;
        }
        Ok(Some(Token::Word(&self.text[start..self.at])))
    }

    fn expect_next(&mut self) -> Result<Token<'a>, CompileError> {
        self.next()?
            .ok_or_else(|| self.error("the file ends in the middle of an entity"))
    }

    fn expect(&mut self, word: &str) -> Result<(), CompileError> {
        match self.expect_next()? {
            Token::Word(w) if w == word => Ok(()),
            other => Err(self.error(format!("found {other:?} where `{word}` belongs"))),
        }
    }

    fn number(&mut self) -> Result<f64, CompileError> {
        let token = self.expect_next()?;
        match token {
            Token::Word(w) => w
                .parse()
                .ok()
                .filter(|n: &f64| n.is_finite() && n.abs() < 1e6),
            Token::Quoted(_) => None,
        }
        .ok_or_else(|| self.error(format!("found {token:?} where a number up to 1e6 belongs")))
    }

    fn numbers<const N: usize>(&mut self) -> Result<[f64; N], CompileError> {
        let mut out = [0.0; N];
        for n in &mut out {
            *n = self.number()?;
        }
        Ok(out)
    }

    fn point_tail(&mut self) -> Result<Vec3, CompileError> {
        let p = self.numbers()?;
        self.expect(")")?;
        Ok(p)
    }
}

/// Parses the text of a `.map` file. Textures are not part of it: add them afterwards.
///
/// # Errors
/// [`CompileError::Parse`] with the line at fault.
pub fn parse_map(text: &str) -> Result<Map, CompileError> {
    let mut lex = Lexer {
        text,
        at: 0,
        line: 1,
    };
    let mut entities = Vec::new();
    while let Some(token) = lex.next()? {
        if token != Token::Word("{") {
            return Err(lex.error(format!("found {token:?} where an entity's `{{` belongs")));
        }
        entities.push(parse_entity(&mut lex)?);
    }
    if entities.is_empty() {
        return Err(lex.error("there is no entity"));
    }
    Ok(Map {
        entities,
        textures: Vec::new(),
    })
}

fn parse_entity(lex: &mut Lexer<'_>) -> Result<Entity, CompileError> {
    let mut entity = Entity::default();
    loop {
        match lex.expect_next()? {
            Token::Word("}") => return Ok(entity),
            Token::Word("{") => entity.brushes.push(parse_brush(lex)?),
            Token::Quoted(key) => match lex.expect_next()? {
                Token::Quoted(value) => entity.keys.push((key.to_owned(), value.to_owned())),
                Token::Word(w) => return Err(lex.error(format!("the value of {key} is {w}"))),
            },
            Token::Word(w) => return Err(lex.error(format!("found {w} in an entity"))),
        }
    }
}

fn parse_brush(lex: &mut Lexer<'_>) -> Result<Brush, CompileError> {
    let mut brush = Brush::default();
    loop {
        match lex.expect_next()? {
            Token::Word("}") => return Ok(brush),
            Token::Word("(") => brush.faces.push(parse_face(lex)?),
            other => return Err(lex.error(format!("found {other:?} in a brush"))),
        }
    }
}

fn parse_face(lex: &mut Lexer<'_>) -> Result<BrushFace, CompileError> {
    let a = lex.point_tail()?;
    lex.expect("(")?;
    let b = lex.point_tail()?;
    lex.expect("(")?;
    let c = lex.point_tail()?;
    let texture = match lex.expect_next()? {
        Token::Word(w) | Token::Quoted(w) => w.to_owned(),
    };
    // Valve 220 opens a bracket here; the classic form goes on with a number.
    let mark = (lex.at, lex.line);
    let projection = if lex.expect_next()? == Token::Word("[") {
        let [x, y, z, s_offset] = lex.numbers()?;
        lex.expect("]")?;
        lex.expect("[")?;
        let [u, v, w, t_offset] = lex.numbers()?;
        lex.expect("]")?;
        let [_rotation, s, t] = lex.numbers()?;
        Projection::Valve {
            axes: [[x, y, z], [u, v, w]],
            offset: [s_offset, t_offset],
            scale: [s, t],
        }
    } else {
        (lex.at, lex.line) = mark;
        let [s_offset, t_offset, rotation, s, t] = lex.numbers()?;
        Projection::Standard {
            offset: [s_offset, t_offset],
            rotation,
            scale: [s, t],
        }
    };
    Ok(BrushFace {
        points: [a, b, c],
        texture,
        projection,
    })
}
