//! Adding films is exact: the same bytes for any order of tiles, splats, passes and partial films.

#![expect(clippy::unwrap_used, reason = "helpers of tests are tests")]

use math::Bounds2i;
use math::hash::{combine, unit_f32};
use proptest::prelude::*;
use steradian_film::{Film, FilmSettings, Filter, Merged, PassBuffer, Sign};

const SIZE: [i32; 2] = [45, 37];
const TILE: i32 = 16;

fn settings(filter: Filter, splats: bool) -> FilmSettings {
    let mut s = FilmSettings::new(SIZE.map(|n| n as u32), filter);
    (s.splats, s.sign, s.aovs) = (splats, Sign::Any, vec!["depth.Z".into(), "albedo.R".into()]);
    if splats {
        s.splat_aovs = ["R", "G", "B"].map(|c| format!("s3t1.{c}")).to_vec();
    }
    s
}

/// The k-th random number of a pass and a place.
fn random(pass: u32, at: u64, k: u64) -> f32 {
    unit_f32((combine(combine(u64::from(pass), at), k) >> 32) as u32)
}

/// Radiance over many orders of magnitude.
fn radiance(pass: u32, at: u64) -> [f32; 3] {
    [3, 4, 5].map(|k| math::trig::exp(20.0 * random(pass, at, k) - 10.0) - 1e-3)
}

fn tiles(film: &Film) -> Vec<Bounds2i> {
    let all = film.settings().sample_bounds();
    let mut tiles = Vec::new();
    for y in (all.min[1]..all.max[1]).step_by(TILE as usize) {
        for x in (all.min[0]..all.max[0]).step_by(TILE as usize) {
            tiles.push(Bounds2i::new([x, y], [x + TILE, y + TILE]).intersect(&all));
        }
    }
    tiles
}

fn fill_tile(tile: &mut steradian_film::FilmTile, bounds: Bounds2i, pass: u32) {
    tile.begin(bounds, pass);
    for y in bounds.min[1]..bounds.max[1] {
        for x in bounds.min[0]..bounds.max[0] {
            let at = (y as u64) << 32 ^ x as u64;
            let offset = [random(pass, at, 0), random(pass, at, 1)];
            tile.add_sample([x, y], offset, radiance(pass, at));
            tile.add_aovs([x, y], offset, &[random(pass, at, 6), -random(pass, at, 7)]);
        }
    }
}

/// Turns 0..n by a hash into another order.
fn shuffled<T>(mut items: Vec<T>, order: u64) -> Vec<T> {
    for i in (1..items.len()).rev() {
        items.swap(i, (combine(order, i as u64) % (i as u64 + 1)) as usize);
    }
    items
}

/// One pass, with tiles and splats in the given order, in lists of uneven length.
fn add_pass(film: &Film, buffer: &mut PassBuffer, pass: u32, order: u64) {
    buffer.begin(pass);
    let mut tile = film.tile();
    for bounds in shuffled(tiles(film), order) {
        fill_tile(&mut tile, bounds, pass);
        buffer.add_tile(&tile);
    }
    if film.settings().splats {
        let mut list = film.splat_list();
        list.begin(pass);
        for i in shuffled((0..500_u64).collect(), order ^ 1) {
            let position = [60.0 * random(pass, i, 10) - 7.0, 60.0 * random(pass, i, 11) - 7.0];
            list.add(position, radiance(pass, i ^ 1 << 60));
            list.add_aov(0, position, radiance(pass, i ^ 1 << 59));
            if i % 97 == order % 97 {
                buffer.add_splats(&mut list);
            }
        }
        buffer.add_splats(&mut list);
    }
    film.add_pass(buffer).unwrap();
}

fn render(s: &FilmSettings, passes: Vec<u32>, order: u64) -> Film {
    let film = Film::new(s.clone()).unwrap();
    let mut buffer = film.pass_buffer().unwrap();
    for p in shuffled(passes, order) {
        add_pass(&film, &mut buffer, p, order ^ u64::from(p));
    }
    film
}

fn filters() -> impl Strategy<Value = Filter> {
    prop_oneof![
        Just(Filter::pixel_box()),
        Just(Filter::gaussian()),
        Just(Filter::mitchell()),
        Just(Filter::Box { radius: [0.8, 2.3] }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_order_and_any_split_give_the_same_bytes(
        filter in filters(), splats: bool, order: u64, split in 0_usize..5, crop: bool, apart: bool,
    ) {
        let mut s = settings(filter, splats);
        if crop {
            s.crop = Bounds2i::new([3, 5], [40, 36]);
        }
        if apart {
            s.iterations = vec![1, 3];
        }
        let whole = render(&s, (0..5).collect(), 0).to_bytes().unwrap();
        prop_assert!(render(&s, (0..5).collect(), order).to_bytes().unwrap() == whole);

        // Two partial films with every other pass, through bytes and back, merged either way.
        let deal = shuffled((0..5).collect::<Vec<u32>>(), order);
        let (a, b) = deal.split_at(split);
        let parts = [a, b].map(|p| render(&s, p.to_vec(), order ^ 7).to_bytes().unwrap());
        for [first, second] in [[0, 1], [1, 0]] {
            let mut film = Film::from_bytes(&parts[first]).unwrap();
            let other = Film::from_bytes(&parts[second]).unwrap();
            let expected = if other.passes().is_empty() { Merged::AlreadyThere } else { Merged::Added };
            prop_assert_eq!(film.merge(&other).unwrap(), expected);
            prop_assert!(film.to_bytes().unwrap() == whole);
        }
    }
}

#[test]
fn tiles_go_straight_to_the_film_with_the_same_bits() {
    let s = settings(Filter::pixel_box(), false);
    let by_buffer = render(&s, vec![0, 1, 2], 0);
    let direct = Film::new(s).unwrap();
    assert!(direct.takes_tiles());
    let mut tile = direct.tile();
    for pass in [2, 0, 1] {
        direct.begin_pass(pass).unwrap();
        assert!(direct.to_bytes().is_err(), "an open pass cannot be saved");
        for bounds in shuffled(tiles(&direct), 5) {
            fill_tile(&mut tile, bounds, pass);
            direct.add_tile(&tile);
        }
        direct.end_pass(pass).unwrap();
    }
    assert!(direct.to_bytes().unwrap() == by_buffer.to_bytes().unwrap());
}

#[test]
fn threads_do_not_matter() {
    let s = settings(Filter::gaussian(), true);
    let alone = render(&s, vec![4], 0);
    let film = Film::new(s).unwrap();
    let mut buffer = film.pass_buffer().unwrap();
    buffer.begin(4);
    let (all, next) = (tiles(&film), std::sync::atomic::AtomicUsize::new(0));
    std::thread::scope(|scope| {
        for worker in 0..4_u64 {
            let (film, buffer, all, next) = (&film, &buffer, &all, &next);
            scope.spawn(move || {
                let (mut tile, mut list) = (film.tile(), film.splat_list());
                list.begin(4);
                while let Some(&bounds) = all.get(next.fetch_add(1, std::sync::atomic::Ordering::Relaxed)) {
                    fill_tile(&mut tile, bounds, 4);
                    buffer.add_tile(&tile);
                }
                for i in (worker..500).step_by(4) {
                    let position = [60.0 * random(4, i, 10) - 7.0, 60.0 * random(4, i, 11) - 7.0];
                    list.add(position, radiance(4, i ^ 1 << 60));
                    list.add_aov(0, position, radiance(4, i ^ 1 << 59));
                }
                buffer.add_splats(&mut list);
            });
        }
    });
    film.begin_pass(4).unwrap();
    std::thread::scope(|scope| {
        for half in 0..2 {
            let (film, buffer) = (&film, &buffer);
            scope.spawn(move || {
                (half..film.n_blocks()).step_by(2).for_each(|i| film.add_pass_block(buffer, i))
            });
        }
    });
    film.take_bad_samples(&buffer);
    film.end_pass(4).unwrap();
    assert!(film.to_bytes().unwrap() == alone.to_bytes().unwrap());
}

#[test]
fn a_crop_is_the_crop_of_the_whole() {
    for filter in [Filter::pixel_box(), Filter::gaussian(), Filter::sinc()] {
        let mut s = settings(filter, true);
        let whole = render(&s, vec![0, 1], 0).develop();
        s.crop = Bounds2i::new([10, 7], [43, 20]);
        let crop = render(&s, vec![0, 1], 0).develop();
        for y in 7..20_usize {
            for x in 10..43_usize {
                let (a, b) = (y * SIZE[0] as usize + x, (y - 7) * 33 + x - 10);
                // Tiles lie differently in a crop. With the box of one pixel that changes no bit; otherwise the tile's
                // doubles are added in another order, and the brightest sample is around 2e7.
                let exact = filter.is_pixel_box();
                let near = |a: f32, b: f32, brightest: f32| {
                    a == b || !exact && (a - b).abs() <= f32::EPSILON * a.abs() + 1e-14 * brightest
                };
                for c in 0..3 {
                    let (m, v) =
                        ([whole.mean[a][c], crop.mean[b][c]], [whole.variance[a][c], crop.variance[b][c]]);
                    assert!(near(m[0], m[1], 2e7), "{filter:?} {x},{y} {m:?}");
                    assert!(near(v[0], v[1], 4e14), "{filter:?} {x},{y} {v:?}");
                }
                assert_eq!(whole.aovs[5 * a..5 * a + 5], crop.aovs[5 * b..5 * b + 5]);
            }
        }
    }
}

#[test]
fn merging_refuses_what_does_not_belong_together() {
    let s = settings(Filter::pixel_box(), false);
    let mut film = render(&s, vec![0, 1, 2], 0);
    let before = film.to_bytes().unwrap();
    assert_eq!(film.merge(&render(&s, vec![1, 2], 0)).unwrap(), Merged::AlreadyThere);
    let overlap = film.merge(&render(&s, vec![2, 3], 0)).unwrap_err();
    assert_eq!(
        overlap.to_string(),
        "passes 2..3 are already in the film, which has 0..3; merge each pass once"
    );
    let mut other = s.clone();
    other.key.seed = 9;
    let seeds = film.merge(&render(&other, vec![7], 0)).unwrap_err();
    assert_eq!(seeds.to_string(), "the films are not of one render: seeds 0 and 9");
    other = s.clone();
    other.filter = Filter::gaussian();
    assert!(film.merge(&render(&other, vec![7], 0)).unwrap_err().to_string().contains("filters"));
    assert!(film.to_bytes().unwrap() == before, "a refused merge changes nothing");
    let mut buffer = film.pass_buffer().unwrap();
    buffer.begin(1);
    assert_eq!(film.add_pass(&mut buffer).unwrap_err().to_string(), "pass 1 is already in the film");
}
