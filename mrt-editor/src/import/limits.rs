//! What a scene may measure.

/// Larger files are refused before they are read.
pub const MAX_FILE_BYTES: u64 = 1 << 30;

/// So many material libraries are opened for a scene.
pub const MAX_LIBRARIES: usize = 256;

/// All material libraries of a scene together have at most so many bytes; those beyond are not read.
pub const MAX_LIBRARY_BYTES: u64 = 64 << 20;

/// So many image files are opened for a scene.
pub const MAX_IMAGES: usize = 4096;

/// All image files of a scene together have at most so many bytes; those beyond are not read.
pub const MAX_IMAGE_BYTES: u64 = 512 << 20;

/// An OBJ of more triangles, or of more vertices or texture coordinates, is refused before they take the memory.
pub const MAX_OBJ_ELEMENTS: usize = 50_000_000;

/// An OBJ that names more materials is refused.
pub const MAX_OBJ_MATERIALS: usize = 1_000_000;

/// Faces of more corners than this are refused: no modeller writes them, and cutting them takes a time that grows with
/// the square of this number.
pub const MAX_POLYGON_CORNERS: usize = 16_384;

/// Larger coordinates, in metres, are refused: squared distances have to stay finite.
pub const MAX_COORDINATE_M: f64 = 1e9;

/// Mean albedos of walls are moved into this range: a wall of albedo 0 never shows a bounce, and between walls of albedo 1
/// light never dies out.
pub const ALBEDO_RANGE: [f32; 2] = [0.05, 0.9];

/// Images with a longer side, in texels, are not read.
pub const MAX_IMAGE_SIDE: u32 = 16_384;

/// Images that need more memory to decode are not read.
pub const MAX_DECODED_BYTES: u64 = 512 << 20;

/// Albedo of what states no colour.
pub const UNSTATED_ALBEDO: f32 = 0.53;

/// More bytes in the files and images that a scene names, all together, are not kept.
pub const MAX_NEIGHBOUR_BYTES: u64 = 1 << 30;

/// More objects and lists in a glTF document are refused before they are read: each takes some hundred bytes.
pub const MAX_JSON_CONTAINERS: usize = 4_000_000;

/// More numbers and names in a glTF document are refused before they are read: each takes some ten bytes.
pub const MAX_JSON_VALUES: usize = 32_000_000;

/// More visits to nodes of a glTF scene are refused: a few nodes that share children can ask for 2^256.
pub const MAX_NODE_VISITS: usize = 1_000_000;

/// More positions than this, counted with instances and before they are made, are refused.
pub const MAX_POSITIONS: usize = 50_000_000;

/// More triangles than this, counted with instances and before they are made, are refused.
pub const MAX_TRIANGLES: usize = 50_000_000;

/// More lamps than this are refused.
pub const MAX_LAMPS: usize = 4096;

/// Longer names of materials are cut, in characters.
pub const MAX_NAME_CHARACTERS: usize = 128;
