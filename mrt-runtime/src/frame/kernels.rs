//! The two products of a pass, one block at a time.

use crate::packed::{Folding, PackedShape, PackedTransport, Values};
use mrt_core::simd::tiles::{
    CHANNELS, ColumnLists, Columns, DOT_ROWS, Element, Rgb, TILE, TileSums, add_half_tile,
    add_tile, add_two_tiles, dot_rows,
};
use mrt_core::simd::{Kernel, Lanes, WIDEST};

/// Classes of a shape with three mirrors.
const MAX_CLASSES: usize = 8;

/// What kernels of one task write on the way.
#[derive(Clone, Debug)]
pub(crate) struct Scratch {
    /// A block's radiosity by class, in that by channel.
    folded: Vec<f32>,
    /// Coefficients times scales.
    scaled: Vec<f32>,
    /// Columns 0, 1, 2 ...
    counting: ColumnLists,
}

impl Scratch {
    /// For blocks of so many slots, and so many coefficients a channel.
    pub(super) fn new(slots: usize, coefficients: usize) -> Self {
        let mut counting = ColumnLists::default();
        counting.push((0..coefficients).map(|k| k as u16));
        Self {
            folded: vec![0.0; CHANNELS * slots],
            scaled: vec![0.0; CHANNELS * coefficients],
            counting,
        }
    }
}

/// Flux in units of a canonical texel's area, by channel.
pub(super) type Flux = [f64; CHANNELS];

/// `b = T_d->b (albedo (direct + indirect) + emission)` of one block.
pub(super) struct CoefficientsOf<'a> {
    pub shape: &'a PackedShape,
    pub direct: [&'a [f32]; CHANNELS],
    pub indirect: Option<[&'a [f32]; CHANNELS]>,
    pub albedo: [&'a [f32]; CHANNELS],
    pub emission: Option<[&'a [f32]; CHANNELS]>,
    pub scratch: &'a mut Scratch,
    /// Channel by channel.
    pub coefficients: &'a mut [f32],
}

/// What left a block's walls.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sent {
    /// All of it.
    pub all: Flux,
    /// Reflected direct light, and emission.
    pub fresh: Flux,
}

impl Kernel for CoefficientsOf<'_> {
    type Output = Sent;

    #[inline(always)]
    fn run<L: Lanes>(mut self, l: L) -> Sent {
        let sent = match self.shape.folding.mirrors {
            0 => fold::<L, 1>(l, &mut self),
            1 => fold::<L, 2>(l, &mut self),
            2 => fold::<L, 4>(l, &mut self),
            _ => fold::<L, 8>(l, &mut self),
        };
        match &self.shape.rows {
            Values::F32(rows) => coefficients(l, rows, &mut self),
            Values::F16(rows) => coefficients(l, rows, &mut self),
            Values::Int8(rows) => coefficients(l, rows, &mut self),
        }
        sent
    }
}

/// Sums and differences of mirrored texels, each mirror in turn: the parts of every class from values at every element
/// of the group, and values from parts.
#[inline(always)]
fn butterflies<L: Lanes, const GROUP: usize>(l: L, v: &mut [L::V; GROUP]) {
    let mut step = 1;
    while step < GROUP {
        let mut k = 0;
        while k < GROUP {
            if k & step == 0 {
                let (a, b) = (v[k], v[k | step]);
                v[k] = l.add(a, b);
                v[k | step] = l.sub(a, b);
            }
            k += 1;
        }
        step *= 2;
    }
}

#[inline(always)]
fn fold<L: Lanes, const GROUP: usize>(l: L, block: &mut CoefficientsOf<'_>) -> Sent {
    let folding = &block.shape.folding;
    let stride = folding.stride;
    let weight = &folding.weight[..stride];
    let mut sent = Sent::default();
    for channel in 0..CHANNELS {
        let direct = &block.direct[channel][..GROUP * stride];
        let albedo = &block.albedo[channel][..GROUP * stride];
        let indirect = block.indirect.map(|i| &i[channel][..GROUP * stride]);
        let emission = block.emission.map(|e| &e[channel][..GROUP * stride]);
        let (mut all, mut fresh) = (l.splat(0.0), l.splat(0.0));
        let mut orbit = 0;
        while orbit < stride {
            let mut v = [l.splat(0.0); GROUP];
            let mut fresh_here = l.splat(0.0);
            for (element, v) in v.iter_mut().enumerate() {
                let at = element * stride + orbit;
                let albedo = l.load(&albedo[at..at + L::N]);
                let mut light = l.mul(albedo, l.load(&direct[at..at + L::N]));
                if let Some(emission) = emission {
                    light = l.add(light, l.load(&emission[at..at + L::N]));
                }
                fresh_here = l.add(fresh_here, light);
                if let Some(indirect) = indirect {
                    light = l.mul_add(albedo, l.load(&indirect[at..at + L::N]), light);
                }
                *v = light;
            }
            butterflies::<L, GROUP>(l, &mut v);
            let weight = l.load(&weight[orbit..orbit + L::N]);
            all = l.mul_add(v[0], weight, all);
            fresh = l.mul_add(fresh_here, weight, fresh);
            for (class, v) in v.into_iter().enumerate() {
                let at = (class * CHANNELS + channel) * stride + orbit;
                l.store(&mut block.scratch.folded[at..at + L::N], v);
            }
            orbit += L::N;
        }
        sent.all[channel] = f64::from(l.sum(all));
        sent.fresh[channel] = f64::from(l.sum(fresh));
    }
    sent
}

#[inline(always)]
fn coefficients<L: Lanes, E: Element>(l: L, rows: &[E], block: &mut CoefficientsOf<'_>) {
    let stride = block.shape.folding.stride;
    let place = block.coefficients.len() / CHANNELS;
    for (k, group) in block.shape.groups.iter().enumerate() {
        let rows = &rows[k * DOT_ROWS * stride..(k + 1) * DOT_ROWS * stride];
        let class = usize::from(group.class) * CHANNELS * stride;
        let folded = &block.scratch.folded[class..class + CHANNELS * stride];
        let x = [
            &folded[..stride],
            &folded[stride..2 * stride],
            &folded[2 * stride..],
        ];
        let sums = dot_rows(l, rows, x);
        for (row, sums) in sums.iter().take(usize::from(group.count)).enumerate() {
            for (channel, sum) in sums.iter().enumerate() {
                let at = channel * place + usize::from(group.modes[row]);
                block.coefficients[at] = sum * group.scales[row];
            }
        }
    }
}

/// Light from all blocks on the walls of one: `r = T_b->r b`, then irradiance from the joint basis.
pub(super) struct IndirectOf<'a> {
    /// Its place.
    pub block: usize,
    pub shape: &'a PackedShape,
    pub transport: &'a PackedTransport,
    /// Coefficients b of all blocks.
    pub coefficients: &'a [f32],
    /// Whether a block has any.
    pub has_coefficients: &'a [bool],
    pub gate_values: &'a [f32],
    pub scratch: &'a mut Scratch,
    /// Joint coefficients of this block.
    pub joint: &'a mut [f32],
    /// Irradiance: what was there before is compared and replaced.
    pub indirect: [&'a mut [f32]; CHANNELS],
}

/// What arrived at a block's walls.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Arrived {
    pub flux: Flux,
    /// Largest change of irradiance, W/m².
    pub change: f32,
    /// Largest irradiance, W/m².
    pub peak: f32,
}

impl Kernel for IndirectOf<'_> {
    type Output = Arrived;

    #[inline(always)]
    fn run<L: Lanes>(mut self, l: L) -> Arrived {
        match &self.transport.values {
            Some(Values::F32(values)) => arrive(l, values, &mut self),
            Some(Values::F16(values)) => arrive(l, values, &mut self),
            Some(Values::Int8(values)) => arrive(l, values, &mut self),
            None => {}
        }
        match (&self.shape.joint, self.shape.folding.mirrors) {
            (Values::F32(joint), 0) => expand::<L, f32, 1>(l, joint, &mut self),
            (Values::F32(joint), 1) => expand::<L, f32, 2>(l, joint, &mut self),
            (Values::F32(joint), 2) => expand::<L, f32, 4>(l, joint, &mut self),
            (Values::F32(joint), _) => expand::<L, f32, 8>(l, joint, &mut self),
            (Values::F16(joint), 0) => expand::<L, u16, 1>(l, joint, &mut self),
            (Values::F16(joint), 1) => expand::<L, u16, 2>(l, joint, &mut self),
            (Values::F16(joint), 2) => expand::<L, u16, 4>(l, joint, &mut self),
            (Values::F16(joint), _) => expand::<L, u16, 8>(l, joint, &mut self),
            (Values::Int8(joint), 0) => expand::<L, i8, 1>(l, joint, &mut self),
            (Values::Int8(joint), 1) => expand::<L, i8, 2>(l, joint, &mut self),
            (Values::Int8(joint), 2) => expand::<L, i8, 4>(l, joint, &mut self),
            (Values::Int8(joint), _) => expand::<L, i8, 8>(l, joint, &mut self),
        }
    }
}

#[inline(always)]
fn arrive<L: Lanes, E: Element>(l: L, values: &[E], block: &mut IndirectOf<'_>) {
    let transport = block.transport;
    let stride = block.coefficients.len() / block.has_coefficients.len().max(1);
    let place = block.joint.len() / CHANNELS;
    let own = &block.coefficients[block.block * stride..(block.block + 1) * stride];
    let tiles = transport.tiles_of_block[block.block].clone();
    for (k, tile) in (tiles.start..tiles.end).enumerate() {
        let tile = &transport.tiles[tile as usize];
        let rows = usize::from(tile.rows);
        let mut sums: TileSums = [[0.0; TILE]; CHANNELS];
        for entry in tile.entries.start..tile.entries.end {
            let entry = &transport.entries[entry as usize];
            let source = entry.source as usize;
            if !block.has_coefficients[source] {
                continue;
            }
            let mut factor = 1.0;
            if entry.gate != u32::MAX {
                factor = block.gate_values[entry.gate as usize];
                if factor == 0.0 {
                    continue;
                }
            }
            let x = &block.coefficients[source * stride..(source + 1) * stride];
            let (start, end) = (entry.columns.start as usize, entry.columns.end as usize);
            let columns = transport.columns.get(start..end);
            let panel = &values[entry.start as usize..][..(end - start) * rows];
            if factor == 1.0 && transport.column_scales.is_empty() {
                add_panel(l, panel, columns, Rgb::new(x), rows, &mut sums);
            } else {
                let scales = transport.column_scales.get(start..end);
                let scratch = &mut *block.scratch;
                scale_columns(columns, x, factor, scales, &mut scratch.scaled);
                let columns = scratch.counting.get(0..end - start);
                let x = Rgb::new(&scratch.scaled);
                add_panel(l, panel, columns, x, rows, &mut sums);
            }
        }
        let modes = &block.shape.row_order[k * TILE..];
        for (channel, sums) in sums.iter().enumerate() {
            let joint = &mut block.joint[channel * place..(channel + 1) * place];
            let own = &own[channel * (stride / CHANNELS)..][..block.shape.modes];
            for (&mode, &sum) in modes.iter().zip(&sums[..rows]) {
                let mode = usize::from(mode);
                // The first joint modes are the block's own.
                joint[mode] = sum * tile.scale + own.get(mode).copied().unwrap_or(0.0);
            }
        }
    }
}

#[inline(always)]
fn add_panel<L: Lanes, E: Element>(
    l: L,
    panel: &[E],
    columns: Columns<'_>,
    x: Rgb<'_>,
    rows: usize,
    sums: &mut TileSums,
) {
    if rows == TILE {
        add_tile(l, panel, columns, x, sums);
    } else {
        add_half_tile(l, panel, columns, x, sums);
    }
}

/// `out[k] = factor * scales[k] * x[columns[k]]`, channel by channel.
#[inline(always)]
fn scale_columns(
    columns: Columns<'_>,
    x: &[f32],
    factor: f32,
    scales: Option<&[f32]>,
    out: &mut [f32],
) {
    let (stride, place) = (x.len() / CHANNELS, out.len() / CHANNELS);
    for channel in 0..CHANNELS {
        let x = &x[channel * stride..(channel + 1) * stride];
        let out = &mut out[channel * place..(channel + 1) * place];
        for (k, &column) in columns.indices().iter().enumerate() {
            let scale = scales.and_then(|scales| scales.get(k)).unwrap_or(&1.0);
            out[k] = x[usize::from(column)] * factor * scale;
        }
    }
}

#[inline(always)]
fn expand<L: Lanes, E: Element, const GROUP: usize>(
    l: L,
    joint: &[E],
    block: &mut IndirectOf<'_>,
) -> Arrived {
    let shape = block.shape;
    let stride = shape.folding.stride;
    let x = scaled_joint(shape, block.joint, block.scratch);
    let x = Rgb::new(x);
    let mut arrived = Partial::new(l);
    let a_tile = TILE * shape.joint_modes;
    let mut sums = [[[[0.0f32; TILE]; CHANNELS]; 2]; MAX_CLASSES];
    let mut tile = 0;
    while tile * TILE < stride {
        let pair = (tile + 1) * TILE < stride;
        let mut at = tile * a_tile;
        for (class, sums) in sums.iter_mut().take(GROUP).enumerate() {
            *sums = [[[0.0; TILE]; CHANNELS]; 2];
            let [first, second] = sums;
            let columns = shape.joint_columns.get(shape.joint_classes[class].clone());
            let size = TILE * columns.indices().len();
            let panel = &joint[at..at + size];
            if pair {
                let next = &joint[at + a_tile..at + a_tile + size];
                add_two_tiles(l, [panel, next], columns, x, [first, second]);
            } else {
                add_tile(l, panel, columns, x, first);
            }
            at += size;
        }
        for half in 0..1 + usize::from(pair) {
            unfold::<L, GROUP>(
                l,
                &sums,
                half,
                (tile + half) * TILE,
                &shape.folding,
                &mut block.indirect,
                &mut arrived,
            );
        }
        tile += 1 + usize::from(pair);
    }
    arrived.total(l)
}

/// Joint coefficients times the scales of a packed basis.
#[inline(always)]
pub(super) fn scaled_joint<'a>(
    shape: &PackedShape,
    joint: &'a [f32],
    scratch: &'a mut Scratch,
) -> &'a [f32] {
    if shape.joint_scales.is_empty() {
        return joint;
    }
    let place = joint.len() / CHANNELS;
    for channel in 0..CHANNELS {
        for (mode, scale) in shape.joint_scales.iter().enumerate() {
            let at = channel * place + mode;
            scratch.scaled[at] = joint[at] * scale;
        }
    }
    &scratch.scaled[..joint.len()]
}

/// [`Arrived`], by lane.
struct Partial<L: Lanes> {
    flux: [L::V; CHANNELS],
    change: L::V,
    peak: L::V,
}

impl<L: Lanes> Partial<L> {
    #[inline(always)]
    fn new(l: L) -> Self {
        Self {
            flux: [l.splat(0.0); CHANNELS],
            change: l.splat(0.0),
            peak: l.splat(0.0),
        }
    }

    #[inline(always)]
    fn total(self, l: L) -> Arrived {
        let [red, green, blue] = self.flux;
        Arrived {
            flux: [
                f64::from(l.sum(red)),
                f64::from(l.sum(green)),
                f64::from(l.sum(blue)),
            ],
            change: l.largest(self.change),
            peak: l.largest(self.peak),
        }
    }
}

/// Irradiance at the texels of a tile of orbits. Truncated bases leave small negative values; they end here, once, on
/// the final sum.
#[inline(always)]
fn unfold<L: Lanes, const GROUP: usize>(
    l: L,
    sums: &[[TileSums; 2]; MAX_CLASSES],
    half: usize,
    first: usize,
    folding: &Folding,
    indirect: &mut [&mut [f32]; CHANNELS],
    arrived: &mut Partial<L>,
) {
    let stride = folding.stride;
    let zero = l.splat(0.0);
    for channel in 0..CHANNELS {
        let out = &mut indirect[channel][..GROUP * stride];
        let mut lane = 0;
        while lane < TILE {
            let mut v = [zero; GROUP];
            for (class, v) in v.iter_mut().enumerate() {
                *v = l.load(&sums[class][half][channel][lane..lane + L::N]);
            }
            butterflies::<L, GROUP>(l, &mut v);
            let mut sum = zero;
            for (element, v) in v.into_iter().enumerate() {
                let at = element * stride + first + lane;
                let out = &mut out[at..at + L::N];
                let now = l.max(v, zero);
                let change = l.abs(l.sub(now, l.load(out)));
                l.store(out, now);
                arrived.change = l.max(change, arrived.change);
                arrived.peak = l.max(now, arrived.peak);
                sum = l.add(sum, now);
            }
            let weight = l.load(&folding.weight[first + lane..first + lane + L::N]);
            arrived.flux[channel] = l.mul_add(sum, weight, arrived.flux[channel]);
            lane += L::N;
        }
    }
}

/// A tiled basis times joint coefficients: row after row, channel by channel.
pub(crate) struct Expand<'a> {
    pub basis: &'a crate::packed::Tiled,
    /// The first so many rows.
    pub rows: usize,
    pub joint: &'a [f32],
    pub scratch: &'a mut Scratch,
    /// At least `rows` numbers a channel.
    pub out: [&'a mut [f32]; CHANNELS],
}

impl Kernel for Expand<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, l: L) {
        let basis = self.basis;
        match &basis.values {
            Values::F32(values) => expand_rows(l, values, &mut self),
            Values::F16(values) => expand_rows(l, values, &mut self),
            Values::Int8(values) => expand_rows(l, values, &mut self),
        }
    }
}

#[inline(always)]
fn expand_rows<L: Lanes, E: Element>(l: L, values: &[E], job: &mut Expand<'_>) {
    let basis = job.basis;
    let columns = basis.columns.get(0..basis.columns.len());
    let count = columns.indices().len();
    let mut x = job.joint;
    if !basis.scales.is_empty() {
        let place = x.len() / CHANNELS;
        for channel in 0..CHANNELS {
            for (mode, scale) in basis.scales.iter().enumerate() {
                let at = channel * place + mode;
                job.scratch.scaled[at] = x[at] * scale;
            }
        }
        x = &job.scratch.scaled[..x.len()];
    }
    let mut row = 0;
    while row < job.rows {
        let panel = |tile: usize| &values[tile * TILE * count..(tile + 1) * TILE * count];
        let mut sums = [[[0.0f32; TILE]; CHANNELS]; 2];
        let [first, second] = &mut sums;
        let pair = row + TILE < job.rows;
        let tile = row / TILE;
        if pair {
            let panels = [panel(tile), panel(tile + 1)];
            add_two_tiles(l, panels, columns, Rgb::new(x), [first, second]);
        } else {
            add_tile(l, panel(tile), columns, Rgb::new(x), first);
        }
        for sums in sums.iter().take(1 + usize::from(pair)) {
            let height = TILE.min(job.rows - row);
            for (out, sums) in job.out.iter_mut().zip(sums) {
                out[row..row + height].copy_from_slice(&sums[..height]);
            }
            row += height;
        }
    }
}

const _: () = assert!(TILE == WIDEST, "strides are whole tiles");
