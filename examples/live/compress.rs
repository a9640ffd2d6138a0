//! Compression of the module that the page contains, to half its size. `expand` in `live.js` is the
//! inverse.
//!
//! The format is that of a block of LZ4, without its conditions on the last bytes: sequences of new
//! bytes, each followed by a copy of earlier bytes.

use std::collections::HashMap;

/// Shortest copy, bytes.
const SHORTEST: usize = 4;
/// Largest distance of a copy from its original, bytes.
const FARTHEST: usize = 0xffff;

/// Compresses bytes.
pub fn compressed(bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    // The last place of each group of bytes.
    let mut places: HashMap<&[u8], usize> = HashMap::new();
    let (mut new, mut at) = (0, 0);
    while let Some(group) = bytes.get(at..at + SHORTEST) {
        let Some(original) = places
            .insert(group, at)
            .filter(|place| at - place <= FARTHEST)
        else {
            at += 1;
            continue;
        };
        let length = bytes[original..]
            .iter()
            .zip(&bytes[at..])
            .take_while(|(a, b)| a == b)
            .count();
        put(&mut out, &bytes[new..at], Some((at - original, length)));
        for inside in at + 1..at + length {
            bytes
                .get(inside..inside + SHORTEST)
                .map(|group| places.insert(group, inside));
        }
        at += length;
        new = at;
    }
    put(&mut out, &bytes[new..], None);
    out
}

/// Writes new bytes, and the distance and length of the copy after them.
fn put(out: &mut Vec<u8>, new: &[u8], copy: Option<(usize, usize)>) {
    // A length has four bits. If they are all set, bytes follow, which are added to it, up to the
    // first below 255.
    let more = |out: &mut Vec<u8>, length: usize| {
        if let Some(rest) = length.checked_sub(15) {
            out.extend(std::iter::repeat_n(255, rest / 255));
            out.push((rest % 255) as u8);
        }
    };
    let copied = copy.map_or(0, |(_, length)| length - SHORTEST);
    out.push(((new.len().min(15) << 4) | copied.min(15)) as u8);
    more(out, new.len());
    out.extend(new);
    if let Some((distance, _)) = copy {
        out.extend((distance as u16).to_le_bytes());
        more(out, copied);
    }
}
