//! KTX 2.0 textures of linear half-precision colours, which engines upload as they are.
//!
//! The layout is that of the Khronos KTX file format specification, version 2.0: header, one level, a basic data format
//! descriptor and two entries of metadata, no supercompression.

use super::picture::Picture;
use mrt_core::storage::f16;

const IDENTIFIER: [u8; 12] = *b"\xabKTX 20\xbb\r\n\x1a\n";

/// Vulkan's `VK_FORMAT_R16G16B16A16_SFLOAT`.
const FORMAT: u32 = 97;

/// Bytes of one number of a pixel.
const NUMBER_SIZE: u32 = 2;

const CHANNELS: u32 = 4;

/// Bytes of a pixel; the level starts at a multiple of it.
const PIXEL_SIZE: usize = (NUMBER_SIZE * CHANNELS) as usize;

/// Bytes of the header with its index, and of the index of one level.
const HEADER_SIZE: usize = 80;
const LEVEL_INDEX_SIZE: usize = 24;

/// What readers should know beside the pixels: rows from the top, columns from the left. Sorted by key.
const METADATA: [(&str, &str); 2] = [("KTXorientation", "rd"), ("KTXwriter", "mrt")];

/// The picture as a texture of format `R16G16B16A16_SFLOAT`, rows from the top, alpha one. Values beyond ±65,504 become
/// ±65,504, and NaN becomes 0; the error is at most 2^-11 of a value, and 2^-25 where that is less.
pub fn ktx2_bytes(picture: &Picture) -> Vec<u8> {
    let descriptor = data_format_descriptor();
    let metadata = metadata();
    let descriptor_start = HEADER_SIZE + LEVEL_INDEX_SIZE;
    let metadata_start = descriptor_start + descriptor.len();
    let level_start = (metadata_start + metadata.len()).next_multiple_of(PIXEL_SIZE);
    let level_size = (picture.pixels.len() * PIXEL_SIZE) as u64;

    let mut bytes = IDENTIFIER.to_vec();
    bytes.reserve(level_start + picture.pixels.len() * PIXEL_SIZE);
    let (depth, layers, faces, levels, supercompression) = (0, 0, 1, 1, 0);
    for word in [
        FORMAT,
        NUMBER_SIZE,
        picture.width as u32,
        picture.height as u32,
        depth,
        layers,
        faces,
        levels,
        supercompression,
        descriptor_start as u32,
        descriptor.len() as u32,
        metadata_start as u32,
        metadata.len() as u32,
    ] {
        bytes.extend(word.to_le_bytes());
    }
    let (global_start, global_size) = (0, 0);
    for word in [
        global_start,
        global_size,
        level_start as u64,
        level_size,
        level_size,
    ] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(descriptor);
    bytes.extend(metadata);
    bytes.resize(level_start, 0);
    for pixel in &picture.pixels {
        let [r, g, b] = pixel.to_array();
        for number in [r, g, b, 1.0] {
            bytes.extend(half_bits(number).to_le_bytes());
        }
    }
    bytes
}

fn half_bits(x: f32) -> u16 {
    let largest = f32::from(f16::MAX);
    if x.is_nan() {
        return 0;
    }
    f16::from_f32(x.clamp(-largest, largest)).to_bits()
}

/// The basic descriptor block of four signed half-precision channels, primaries of BT.709, linear.
fn data_format_descriptor() -> Vec<u8> {
    const BLOCK_HEADER_SIZE: u32 = 24;
    const SAMPLE_SIZE: u32 = 16;
    const VERSION: u32 = 2;
    const MODEL_RGBSDA: u8 = 1;
    const PRIMARIES_BT709: u8 = 1;
    const TRANSFER_LINEAR: u8 = 1;
    const FLAGS: u8 = 0;
    const SIGNED_FLOAT: u32 = 0xc0;
    let block_size = BLOCK_HEADER_SIZE + SAMPLE_SIZE * CHANNELS;
    let mut bytes = Vec::new();
    let mut word = |word: u32| bytes.extend(word.to_le_bytes());
    word(4 + block_size);
    // Vendor Khronos, descriptor type basic.
    word(0);
    word(VERSION | block_size << 16);
    word(u32::from_le_bytes([
        MODEL_RGBSDA,
        PRIMARIES_BT709,
        TRANSFER_LINEAR,
        FLAGS,
    ]));
    // A texel block is one texel, in one plane.
    word(0);
    word(PIXEL_SIZE as u32);
    word(0);
    const ALPHA: u32 = 15;
    for (index, channel) in (0u32..).zip([0, 1, 2, ALPHA]) {
        let bits = 8 * NUMBER_SIZE;
        word((index * bits) | (bits - 1) << 16 | (channel | SIGNED_FLOAT) << 24);
        word(0);
        // What counts as -1 and as 1.
        word((-1f32).to_bits());
        word(1f32.to_bits());
    }
    bytes
}

fn metadata() -> Vec<u8> {
    let mut bytes = Vec::new();
    for (key, value) in METADATA {
        let entry = format!("{key}\0{value}\0");
        bytes.extend((entry.len() as u32).to_le_bytes());
        bytes.extend(entry.as_bytes());
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn another_reader_finds_the_picture() {
        let pixels = vec![
            Vec3::new(0.25, 1.5, 1024.0),
            Vec3::new(f32::NAN, -1e9, f32::INFINITY),
            Vec3::ZERO,
            Vec3::ONE,
            Vec3::splat(0.1),
            Vec3::X,
        ];
        let picture = Picture {
            width: 3,
            height: 2,
            pixels,
        };
        let bytes = ktx2_bytes(&picture);
        let reader = ktx2::Reader::new(&bytes).expect("a sound file");
        let header = reader.header();
        assert_eq!(header.format, Some(ktx2::Format::R16G16B16A16_SFLOAT));
        assert_eq!((header.pixel_width, header.pixel_height), (3, 2));
        let metadata: Vec<_> = reader
            .key_value_data()
            .map(|(key, value)| (key, std::str::from_utf8(value).expect("text")))
            .collect();
        assert_eq!(metadata[0], ("KTXorientation", "rd\0"));
        let blocks = reader.dfd_blocks().count();
        assert_eq!(blocks, 1);
        let levels: Vec<_> = reader.levels().collect();
        let [level] = &levels[..] else {
            panic!("{} levels", levels.len());
        };
        let numbers: Vec<f32> = level
            .data
            .as_chunks::<2>()
            .0
            .iter()
            .map(|&bits| f16::from_le_bytes(bits).to_f32())
            .collect();
        assert_eq!(numbers[..4], [0.25, 1.5, 1024.0, 1.0]);
        assert_eq!(numbers[4..8], [0.0, -65_504.0, 65_504.0, 1.0]);
        assert!((numbers[16] - 0.1).abs() <= 0.1 / 2048.0);
        assert_eq!(numbers.len(), 24);
    }
}
