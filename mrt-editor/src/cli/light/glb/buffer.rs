//! The numbers of a binary glTF file, and the file around them.

use serde_json::{Value, json};

/// The version of the container.
const VERSION: u32 = 2;

/// What the format calls types of numbers and uses of buffer views.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const VERTICES: u32 = 34_962;
const INDICES: u32 = 34_963;

/// The single buffer with its views and accessors.
#[derive(Default)]
pub(super) struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Adds `N` numbers of each vertex, from number `first` on; gives the accessor.
    pub(super) fn add_vectors<const N: usize>(
        &mut self,
        vertices: &[impl AsRef<[f32]>],
        first: usize,
    ) -> usize {
        let (mut low, mut high) = ([f32::INFINITY; N], [f32::NEG_INFINITY; N]);
        let start = self.bytes.len();
        for vertex in vertices {
            for (k, &number) in vertex.as_ref()[first..][..N].iter().enumerate() {
                low[k] = low[k].min(number);
                high[k] = high[k].max(number);
                self.bytes.extend(number.to_le_bytes());
            }
        }
        let view = self.close_view(start, Some(VERTICES));
        self.accessors.push(json!({
            "bufferView": view,
            "componentType": FLOAT,
            "count": vertices.len(),
            "type": format!("VEC{N}"),
            "min": low.to_vec(),
            "max": high.to_vec(),
        }));
        self.accessors.len() - 1
    }

    /// Adds the vertices of triangles; gives the accessor.
    pub(super) fn add_indices(&mut self, indices: &[u32]) -> usize {
        let start = self.bytes.len();
        self.bytes
            .extend(indices.iter().flat_map(|index| index.to_le_bytes()));
        let view = self.close_view(start, Some(INDICES));
        self.accessors.push(json!({
            "bufferView": view,
            "componentType": UNSIGNED_INT,
            "count": indices.len(),
            "type": "SCALAR",
        }));
        self.accessors.len() - 1
    }

    /// Adds a file as it is; gives the buffer view.
    pub(super) fn add_bytes(&mut self, bytes: &[u8]) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        self.close_view(start, None)
    }

    fn close_view(&mut self, start: usize, target: Option<u32>) -> usize {
        let mut view =
            json!({"buffer": 0, "byteOffset": start, "byteLength": self.bytes.len() - start});
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.views.push(view);
        // What follows starts at a multiple of four.
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.len() - 1
    }

    /// The file of a document, which gets the lists of accessors, views and buffers.
    pub(super) fn into_file(self, mut root: Value) -> Vec<u8> {
        root["accessors"] = self.accessors.into();
        root["bufferViews"] = self.views.into();
        root["buffers"] = json!([{"byteLength": self.bytes.len()}]);
        let mut text = root.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + text.len() + 8 + self.bytes.len();
        let mut file = Vec::with_capacity(length);
        file.extend(b"glTF");
        for word in [VERSION, length as u32] {
            file.extend(word.to_le_bytes());
        }
        for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &self.bytes)] {
            file.extend((chunk.len() as u32).to_le_bytes());
            file.extend(kind);
            file.extend(chunk);
        }
        file
    }
}
