//! The cells of a pass: blocks of light paths, then tiles cut on a grid that is fixed to the film.

use integrators::Cell;
use math::Bounds2i;

/// Side of a tile in pixels: large enough that the filter's border and the hand-over cost little, small enough that all
/// threads have work. Part of the settings, so that a tile's sums never depend on the machine.
pub const TILE_SIDE: i32 = 32;

/// All cells of a pass. Light blocks come first: they are fewer and longer.
#[must_use]
pub fn of_pass(sample_bounds: Bounds2i, light_blocks: u32) -> Vec<Cell> {
    let mut cells: Vec<Cell> = (0..light_blocks).map(Cell::LightBlock).collect();
    let Bounds2i { min, max } = sample_bounds;
    let grid = |a: usize| min[a].div_euclid(TILE_SIDE)..(max[a] - 1).div_euclid(TILE_SIDE) + 1;
    for row in grid(1) {
        for column in grid(0) {
            let corner = [column * TILE_SIDE, row * TILE_SIDE];
            let tile = Bounds2i::new(corner, [corner[0] + TILE_SIDE, corner[1] + TILE_SIDE]);
            cells.push(Cell::Tile(tile.intersect(&sample_bounds)));
        }
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tiles(bounds: Bounds2i) -> Vec<Bounds2i> {
        let tile = |c: Cell| match c {
            Cell::Tile(t) => t,
            Cell::LightBlock(_) => panic!("no light blocks were asked for"),
        };
        of_pass(bounds, 0).into_iter().map(tile).collect()
    }

    #[test]
    fn tiles_cover_every_pixel_once() {
        for bounds in [
            Bounds2i::new([-2, -2], [66, 34]),
            Bounds2i::new([5, 7], [6, 8]),
            Bounds2i::new([32, 64], [96, 96]),
        ] {
            let tiles = tiles(bounds);
            assert_eq!(tiles.iter().map(Bounds2i::area).sum::<usize>(), bounds.area());
            assert!(tiles.iter().all(|t| t.area() > 0 && t.intersect(&bounds) == *t));
        }
    }

    #[test]
    fn a_crop_cuts_on_the_same_lines() {
        let all = tiles(Bounds2i::new([0, 0], [200, 200]));
        for tile in tiles(Bounds2i::new([40, 50], [150, 170])) {
            assert!(all.iter().any(|t| t.intersect(&tile) == tile));
        }
    }
}
