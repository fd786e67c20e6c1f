//! Items are numbered through all geometries; which geometry and primitive is an item?

/// The first item and the items per primitive of each geometry.
#[derive(Clone, Debug, Default)]
pub(crate) struct Numbering {
    geometries: Vec<Range>,
    /// For each `1 << shift` items, the geometry of the first of them, and the last geometry at the end.
    starts: Vec<u32>,
    shift: u32,
}

#[derive(Clone, Copy, Debug)]
struct Range {
    first: u32,
    stride: u32,
}

impl Numbering {
    /// Adds a geometry, whose items come after those of the ones before.
    pub(crate) fn push(&mut self, first: u32, stride: u32) {
        self.geometries.push(Range { first, stride });
    }

    /// Prepares for [`Numbering::locate`].
    pub(crate) fn finish(&mut self, total: u32) {
        let wanted = (4 * self.geometries.len()).clamp(1, 1 << 16) as u32;
        self.shift = (total / wanted).max(1).ilog2();
        self.starts = (0..=total >> self.shift).map(|i| self.last_from(i << self.shift)).collect();
        self.starts.push(self.geometries.len().saturating_sub(1) as u32);
    }

    fn last_from(&self, item: u32) -> u32 {
        self.geometries.partition_point(|g| g.first <= item).saturating_sub(1) as u32
    }

    /// The first item of a geometry.
    pub(crate) fn first(&self, geometry: u32) -> u32 {
        self.geometries[geometry as usize].first
    }

    /// The geometry and primitive of an item.
    #[inline(always)]
    pub(crate) fn locate(&self, item: u32) -> (u32, u32) {
        let at = (item >> self.shift) as usize;
        let (low, high) = (self.starts[at], self.starts[at + 1]);
        let mut geometry = low;
        if low != high {
            let between = &self.geometries[low as usize + 1..=high as usize];
            geometry += between.partition_point(|g| g.first <= item) as u32;
        }
        let Range { first, stride } = self.geometries[geometry as usize];
        let primitive = item - first;
        (geometry, if stride == 1 { primitive } else { primitive / stride })
    }

    /// Bytes in memory.
    pub(crate) fn memory(&self) -> usize {
        self.geometries.len() * size_of::<Range>() + self.starts.len() * size_of::<u32>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_finds_its_geometry_and_primitive() {
        let counts = [0_u32, 5, 0, 0, 1, 1000, 2, 2, 2, 0, 300_000, 1, 0];
        for stride in [1, 8] {
            let mut numbering = Numbering::default();
            let mut total = 0;
            for count in counts {
                numbering.push(total, stride);
                total += count * stride;
            }
            numbering.finish(total);
            let mut item = 0;
            for (count, geometry) in counts.into_iter().zip(0..) {
                for i in 0..count * stride {
                    assert_eq!(numbering.locate(item), (geometry, i / stride));
                    item += 1;
                }
            }
        }
    }
}
