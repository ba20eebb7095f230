//! Changes of bytes without knowledge of the format, for tests that must give the same inputs everywhere.

use crate::random::Random;

/// Bytes that are often a limit of something.
const BYTES: [u8; 9] = [0, 1, 2, 4, 0x7f, 0x80, 0xfe, 0xff, b'"'];

/// Changes one to four places: bits, bytes, numbers of four bytes, and pieces that are copied, removed or put in.
pub fn change_bytes(random: &mut Random, bytes: &mut Vec<u8>, most: usize) {
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len() + 1);
        let length = random.below(9).min(bytes.len() - at);
        match random.below(7) {
            0 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
            1 if at < bytes.len() => bytes[at] = BYTES[random.below(BYTES.len())],
            2 if at < bytes.len() => bytes[at] = random.bits() as u8,
            3 => drop(bytes.drain(at..at + length)),
            4 => {
                let copy = bytes[at..at + length].to_vec();
                let to = random.below(bytes.len() + 1);
                bytes.splice(to..to, copy);
            }
            5 => {
                let value = (random.bits() >> random.below(64)) as u32;
                let aligned = at / 4 * 4;
                if let Some(word) = bytes.get_mut(aligned..aligned + 4) {
                    word.copy_from_slice(&value.to_le_bytes());
                }
            }
            _ => bytes.insert(at, random.bits() as u8),
        }
    }
    bytes.truncate(most);
}

/// Changes one to three places of a text: a word of the format is put in, or takes the place of what is there.
pub fn change_tokens(random: &mut Random, bytes: &mut Vec<u8>, most: usize, words: &[&str]) {
    if words.is_empty() {
        return;
    }
    for _ in 0..1 + random.below(3) {
        let word = words[random.below(words.len())].bytes();
        let at = random.below(bytes.len() + 1);
        let is_part = |byte: &u8| !byte.is_ascii_whitespace() && !b",[]{}\"=:".contains(byte);
        let length = match random.below(3) {
            0 => 0,
            _ => bytes[at..].iter().take_while(|byte| is_part(byte)).count(),
        };
        bytes.splice(at..at + length, word);
    }
    bytes.truncate(most);
}
