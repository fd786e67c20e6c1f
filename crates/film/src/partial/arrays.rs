//! The arrays of a partial film: the sums of blocks as rows of little-endian integers, and back.

use safetensors::tensor::Dtype;

use crate::blocks::offset_in;
use crate::film::{Film, FilmBlock, add_moments, add_one, add_weight};
use crate::fixed::{FixedPoint, add3};
use crate::settings::FilmSettings;

/// Which sums of a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Field {
    Total,
    TotalSquared,
    Weight,
    WeightSquared,
    TotalWeight,
    Splat,
    Aovs,
    SplatAovs,
}

impl Field {
    /// Those that a film of these settings has, in the order of their names, which is that of the file.
    pub(super) fn of(s: &FilmSettings) -> Vec<Self> {
        let weighted = !s.filter.is_pixel_box();
        let mut fields = vec![Self::Total, Self::TotalSquared];
        if weighted {
            fields.extend([Self::Weight, Self::WeightSquared, Self::TotalWeight]);
        }
        if weighted && s.splats {
            fields.push(Self::Splat);
        }
        if !s.aovs.is_empty() {
            fields.push(Self::Aovs);
        }
        if !s.splat_aovs.is_empty() {
            fields.push(Self::SplatAovs);
        }
        fields.sort_by_key(Self::name);
        fields
    }

    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Total => "total",
            Self::TotalSquared => "total_squared",
            Self::Weight => "weight",
            Self::WeightSquared => "weight_squared",
            Self::TotalWeight => "total_weight",
            Self::Splat => "splat",
            Self::Aovs => "aovs",
            Self::SplatAovs => "splat_aovs",
        }
    }

    pub(super) fn dtype(self) -> Dtype {
        match self {
            Self::Weight | Self::WeightSquared => Dtype::I64,
            Self::Total
            | Self::TotalSquared
            | Self::TotalWeight
            | Self::Splat
            | Self::Aovs
            | Self::SplatAovs => Dtype::U64,
        }
    }

    /// Iterations if there are several, rows, columns, then channels and the two halves of each 128-bit number.
    pub(super) fn shape(self, s: &FilmSettings) -> Vec<usize> {
        let mut shape = match s.iterations.len() {
            0 => Vec::new(),
            n => vec![n + 1],
        };
        shape.extend([s.crop.height(), s.crop.width()]);
        match self {
            Self::Weight | Self::WeightSquared => {}
            Self::Total | Self::TotalSquared | Self::TotalWeight | Self::Splat => shape.extend([3, 2]),
            Self::Aovs => shape.extend([s.aovs.len(), 2]),
            Self::SplatAovs => shape.extend([s.splat_aovs.len(), 2]),
        }
        shape
    }

    /// How many bytes the array has.
    pub(super) fn len(self, s: &FilmSettings) -> usize {
        self.shape(s).iter().product::<usize>() * 8
    }

    /// Writes the array, of the right length: pixel by pixel in rows.
    pub(super) fn write(self, film: &Film, to: &mut [u8]) {
        match self {
            Self::Total => gather(film, 1, to, |b| &b.total),
            Self::TotalSquared => gather(film, 1, to, |b| &b.total_squared),
            Self::Weight => gather(film, 1, to, |b| &b.weight),
            Self::WeightSquared => gather(film, 1, to, |b| &b.weight_squared),
            Self::TotalWeight => gather(film, 1, to, |b| &b.total_weight),
            Self::Splat => gather(film, 1, to, |b| &b.splat),
            Self::Aovs => gather(film, film.common.n_aovs, to, |b| &b.aovs),
            Self::SplatAovs => gather(film, film.common.n_splat_aovs, to, |b| &b.splat_aovs),
        }
    }

    /// Adds the array's bytes, of the right number, to a film's sums, as [`Film::merge`] would.
    pub(super) fn add(self, film: &Film, data: &[u8]) {
        match self {
            Self::Total => scatter(film, 1, data, |b| &mut b.total, add3),
            Self::TotalSquared => scatter(film, 1, data, |b| &mut b.total_squared, add_moments),
            Self::Weight => scatter(film, 1, data, |b| &mut b.weight, add_weight),
            Self::WeightSquared => scatter(film, 1, data, |b| &mut b.weight_squared, add_weight),
            Self::TotalWeight => scatter(film, 1, data, |b| &mut b.total_weight, add3),
            Self::Splat => scatter(film, 1, data, |b| &mut b.splat, add3),
            Self::Aovs => scatter(film, film.common.n_aovs, data, |b| &mut b.aovs, add_one),
            Self::SplatAovs => scatter(film, film.common.n_splat_aovs, data, |b| &mut b.splat_aovs, add_one),
        }
    }
}

/// A number with a fixed little-endian form.
trait LittleEndian {
    const SIZE: usize;
    fn write(&self, to: &mut [u8]);
    fn read(from: &[u8]) -> Self;
}

impl LittleEndian for i64 {
    const SIZE: usize = 8;
    fn write(&self, to: &mut [u8]) {
        to.copy_from_slice(&self.to_le_bytes());
    }
    #[inline]
    fn read(from: &[u8]) -> Self {
        let mut b = [0; 8];
        b.copy_from_slice(from);
        Self::from_le_bytes(b)
    }
}

/// The lower half first: two 64-bit words, of which the second has the sign.
impl<const F: u32> LittleEndian for FixedPoint<F> {
    const SIZE: usize = 16;
    fn write(&self, to: &mut [u8]) {
        to.copy_from_slice(&self.to_bits().to_le_bytes());
    }
    #[inline]
    fn read(from: &[u8]) -> Self {
        let mut b = [0; 16];
        b.copy_from_slice(from);
        Self::from_bits(i128::from_le_bytes(b))
    }
}

impl<T: LittleEndian> LittleEndian for [T; 3] {
    const SIZE: usize = 3 * T::SIZE;
    fn write(&self, to: &mut [u8]) {
        self.iter().zip(to.chunks_exact_mut(T::SIZE)).for_each(|(x, to)| x.write(to));
    }
    #[inline]
    fn read(from: &[u8]) -> Self {
        std::array::from_fn(|i| T::read(&from[i * T::SIZE..(i + 1) * T::SIZE]))
    }
}

/// From blocks, with `n` numbers per pixel, to rows.
fn gather<T: LittleEndian>(film: &Film, n: usize, bytes: &mut [u8], get: impl Fn(&FilmBlock) -> &[T]) {
    let crop = film.settings().crop;
    for (blocks, bytes) in film.iterations.iter().zip(bytes.chunks_exact_mut(crop.area() * n * T::SIZE)) {
        for i in 0..blocks.len() {
            let block = blocks.lock(i);
            let per_row = block.area.width() * n;
            for (row, values) in get(&block).chunks_exact(per_row).enumerate() {
                let at = offset_in(&crop, block.area.min[0], block.area.min[1] + row as i32) * n * T::SIZE;
                let to = bytes[at..at + per_row * T::SIZE].chunks_exact_mut(T::SIZE);
                values.iter().zip(to).for_each(|(x, to)| x.write(to));
            }
        }
    }
}

/// The way back: adds rows to blocks.
fn scatter<T: LittleEndian>(
    film: &Film,
    n: usize,
    bytes: &[u8],
    get: impl Fn(&mut FilmBlock) -> &mut Vec<T>,
    add: impl Fn(&mut T, &T),
) {
    let crop = film.settings().crop;
    for (blocks, bytes) in film.iterations.iter().zip(bytes.chunks_exact(crop.area() * n * T::SIZE)) {
        for i in 0..blocks.len() {
            let mut block = blocks.lock(i);
            let area = block.area;
            let per_row = area.width() * n;
            for (row, values) in get(&mut block).chunks_exact_mut(per_row).enumerate() {
                let at = offset_in(&crop, area.min[0], area.min[1] + row as i32) * n * T::SIZE;
                let from = bytes[at..at + per_row * T::SIZE].chunks_exact(T::SIZE);
                values.iter_mut().zip(from).for_each(|(x, from)| add(x, &T::read(from)));
            }
        }
    }
}
