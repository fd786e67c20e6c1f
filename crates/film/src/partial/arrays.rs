//! The arrays of a partial film: the sums of blocks as rows of little-endian integers, and back.

use safetensors::tensor::Dtype;

use crate::blocks::offset_in;
use crate::film::Film;
use crate::fixed::FixedPoint;
use crate::settings::FilmSettings;
use crate::sums::Sums;

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

    /// Writes the array, of the right length and all zeros: pixel by pixel in rows.
    pub(super) fn write(self, film: &Film, to: &mut [u8]) {
        let (n, n_splats) = (film.common.n_aovs, film.common.n_splat_aovs);
        match self {
            Self::Total => gather(film, 3, to, |s, i| wide(s.total.get(i))),
            Self::TotalSquared => gather(film, 3, to, |s, i| wide(s.total_squared.get(i))),
            Self::Weight => gather(film, 1, to, |s, i| s.weight[i].to_le_bytes()),
            Self::WeightSquared => gather(film, 1, to, |s, i| s.weight_squared[i].to_le_bytes()),
            Self::TotalWeight => gather(film, 3, to, |s, i| wide(s.total_weight.get(i))),
            Self::Splat => gather(film, 3, to, |s, i| wide(s.splat.get(i))),
            Self::Aovs => gather(film, n, to, |s, i| wide(s.aovs.get(i))),
            Self::SplatAovs => gather(film, n_splats, to, |s, i| wide(s.splat_aovs.get(i))),
        }
    }

    /// Adds the array's bytes, of the right number, to a film's sums, as [`Film::merge`] would.
    pub(super) fn add(self, film: &Film, data: &[u8]) {
        let (n, n_splats) = (film.common.n_aovs, film.common.n_splat_aovs);
        match self {
            Self::Total => scatter(film, 3, data, |s, i, x| s.total.add(i, number(x))),
            Self::TotalSquared => {
                scatter(film, 3, data, |s, i, x| s.total_squared.add_saturating(i, number(x)));
            }
            Self::Weight => scatter(film, 1, data, |s, i, x| add_weight(&mut s.weight[i], x)),
            Self::WeightSquared => scatter(film, 1, data, |s, i, x| add_weight(&mut s.weight_squared[i], x)),
            Self::TotalWeight => scatter(film, 3, data, |s, i, x| s.total_weight.add(i, number(x))),
            Self::Splat => scatter(film, 3, data, |s, i, x| s.splat.add(i, number(x))),
            Self::Aovs => scatter(film, n, data, |s, i, x| s.aovs.add(i, number(x))),
            Self::SplatAovs => scatter(film, n_splats, data, |s, i, x| s.splat_aovs.add(i, number(x))),
        }
    }
}

/// The lower half first: two little-endian 64-bit words, of which the second has the sign.
#[inline]
fn wide<const F: u32>(x: FixedPoint<F>) -> [u8; 16] {
    x.to_bits().to_le_bytes()
}

/// The way back.
#[inline]
fn number<const F: u32>(bytes: &[u8; 16]) -> FixedPoint<F> {
    FixedPoint::from_bits(i128::from_le_bytes(*bytes))
}

#[inline]
fn add_weight(sum: &mut i64, bytes: &[u8; 8]) {
    *sum = sum.wrapping_add(i64::from_le_bytes(*bytes));
}

/// From blocks, with `n` numbers of `SIZE` bytes per pixel, to rows. Blocks without sums leave their zeros.
fn gather<const SIZE: usize>(
    film: &Film,
    n: usize,
    bytes: &mut [u8],
    get: impl Fn(&Sums, usize) -> [u8; SIZE],
) {
    let crop = film.settings().crop;
    for (blocks, bytes) in film.iterations.iter().zip(bytes.chunks_exact_mut(crop.area() * n * SIZE)) {
        for i in 0..blocks.len() {
            let block = blocks.lock(i);
            let Some(sums) = block.sums(&film.common) else { continue };
            let per_row = block.area.width() * n;
            for row in 0..block.area.height() {
                let at = offset_in(&crop, block.area.min[0], block.area.min[1] + row as i32) * n * SIZE;
                let to = bytes[at..at + per_row * SIZE].chunks_exact_mut(SIZE);
                (row * per_row..).zip(to).for_each(|(i, to)| to.copy_from_slice(&get(&sums, i)));
            }
        }
    }
}

/// The way back: adds rows to blocks.
fn scatter<const SIZE: usize>(
    film: &Film,
    n: usize,
    bytes: &[u8],
    add: impl Fn(&mut Sums, usize, &[u8; SIZE]),
) {
    let crop = film.settings().crop;
    for (blocks, bytes) in film.iterations.iter().zip(bytes.chunks_exact(crop.area() * n * SIZE)) {
        for i in 0..blocks.len() {
            let mut block = blocks.lock(i);
            let area = block.area;
            let per_row = area.width() * n;
            let sums = block.sums_mut(&film.common);
            for row in 0..area.height() {
                let at = offset_in(&crop, area.min[0], area.min[1] + row as i32) * n * SIZE;
                let (numbers, _) = bytes[at..at + per_row * SIZE].as_chunks::<SIZE>();
                (row * per_row..).zip(numbers).for_each(|(i, x)| add(sums, i, x));
            }
        }
    }
}
