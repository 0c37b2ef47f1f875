//! glTF in one file: the document, then the buffer with the pictures.

use super::Built;
use super::buffer::Buffer;
use anyhow::{Context as _, Result};
use serde_json::{Value, json};

/// Encodes the container: a header, a chunk of JSON padded with spaces, a chunk of bytes padded
/// with zeros (glTF 2.0, "GLB File Format Specification").
pub(super) fn encode(built: Built) -> Result<Vec<u8>> {
    let Built {
        mut document,
        buffer,
        pictures,
        ..
    } = built;
    let views = match document["bufferViews"].take() {
        Value::Array(views) => views,
        _ => Vec::new(),
    };
    let mut buffer = Buffer {
        bytes: buffer,
        views,
        accessors: Vec::new(),
    };
    for (i, (_, png)) in pictures.iter().enumerate() {
        let view = buffer.view(png, None);
        document["images"][i]["bufferView"] = view.into();
        document["images"][i]["mimeType"] = "image/png".into();
    }
    let Buffer {
        bytes: mut binary,
        views,
        ..
    } = buffer;
    binary.resize(binary.len().next_multiple_of(4), 0);
    document["bufferViews"] = views.into();
    document["buffers"] = json!([{"byteLength": binary.len()}]);
    let mut text = serde_json::to_vec(&document)?;
    text.resize(text.len().next_multiple_of(4), b' ');
    let length = |n: usize| u32::try_from(n).context("larger than a .glb can be: 4 GiB");
    let total = length(12 + 8 + text.len() + 8 + binary.len())?;
    let mut out = Vec::with_capacity(total as usize);
    out.extend_from_slice(b"glTF");
    for word in [2, total] {
        out.extend_from_slice(&u32::to_le_bytes(word));
    }
    for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &binary)] {
        out.extend_from_slice(&length(chunk.len())?.to_le_bytes());
        out.extend_from_slice(kind);
        out.extend_from_slice(chunk);
    }
    Ok(out)
}
