//! The film's bits do not depend on threads, order or how passes are split; nothing complete is lost by a stop.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::num::NonZero;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use film::{Film, FilmSettings, Filter, PassSet};
use integrators::{Cell, CellOutput, Counters, Prepared};
use math::Bounds2i;
use math::hash::{combine, unit_f32};
use steradian_render::{Cancel, Checkpointer, Control, Event, Passes, RunReport, Stop, Viewer, Workers, run};

/// Random samples and splats; what is prepared decides the brightness.
struct Noise {
    prepares: bool,
    /// A preparation lasts up to this pass.
    until: u32,
    light_blocks: u32,
    brightness: f32,
    busy: Duration,
    cells: AtomicUsize,
    prepared: Mutex<Vec<u32>>,
}

fn noise() -> Noise {
    Noise {
        prepares: false,
        until: 0,
        light_blocks: 0,
        brightness: 1.0,
        busy: Duration::ZERO,
        cells: AtomicUsize::new(0),
        prepared: Mutex::default(),
    }
}

fn random(key: &[u32]) -> f32 {
    unit_f32((key.iter().fold(7, |h, &k| combine(h, u64::from(k))) >> 32) as u32)
}

impl Passes for Noise {
    fn prepares(&self) -> bool {
        self.prepares
    }

    fn prepare(&mut self, pass: u32) -> Prepared {
        self.brightness = random(&[pass]);
        self.prepared.lock().unwrap().push(pass);
        let counters = Counters { rays: 1, ..Counters::default() };
        Prepared { counters, warning: Some("odd".to_owned()), until: self.until }
    }

    fn light_blocks(&self) -> u32 {
        self.light_blocks
    }

    fn cell(&self, pass: u32, cell: Cell, out: &mut CellOutput) {
        self.cells.fetch_add(1, Ordering::Relaxed);
        std::thread::sleep(self.busy);
        match cell {
            Cell::Tile(Bounds2i { min, max }) => {
                for (x, y) in (min[1]..max[1]).flat_map(|y| (min[0]..max[0]).map(move |x| (x, y))) {
                    let u = |k| random(&[x as u32, y as u32, pass, k]);
                    let v = self.brightness * (0.1 + 1.0 / (0.001 + u(0)));
                    let rgb = if u(3) < 0.001 { [f32::NAN; 3] } else { [v, v * u(4), u(5)] };
                    out.tile.add_sample([x, y], [u(1), u(2)], rgb);
                    out.counters.camera_paths += 1;
                }
            }
            Cell::LightBlock(b) => {
                for i in 0..500 {
                    let u = |k| random(&[b, i, pass, k + 10_u32]);
                    out.splats.add([u(0) * 110.0 - 5.0, u(1) * 80.0 - 5.0], [u(2), u(3), 1e3 * u(4)]);
                    out.counters.light_paths += 1;
                }
            }
        }
    }
}

fn film(filter: Filter, splats: bool) -> Film {
    Film::new(FilmSettings { splats, ..FilmSettings::new([100, 70], filter) }).unwrap()
}

fn workers(n: usize) -> Workers {
    Workers::new(NonZero::new(n)).unwrap()
}

fn render(noise: &mut Noise, film: &Film, stop: Stop, threads: usize) -> RunReport {
    let control =
        Control { cancel: Cancel::default(), checkpoint: None, viewer: None, on_event: &mut |_| {} };
    run(noise, film, &stop, &workers(threads), control).unwrap()
}

fn gaussian() -> Filter {
    Filter::gaussian()
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    // The last: what is prepared for pass 0 holds for passes 1 to 3.
    for (filter, light_blocks, prepares, until) in [
        (Filter::pixel_box(), 0, false, 0),
        (gaussian(), 7, false, 0),
        (gaussian(), 3, true, 0),
        (gaussian(), 3, true, 4),
    ] {
        let developed = |threads: usize| {
            let film = film(filter, light_blocks > 0);
            let mut n = Noise { prepares, until, light_blocks, ..noise() };
            let report = render(&mut n, &film, Stop::Passes(0..6), threads);
            assert_eq!(report.passes, 6);
            assert_eq!(report.counters.light_paths, 6 * 500 * u64::from(light_blocks));
            assert_eq!(report.counters.camera_paths, 6 * film.settings().sample_bounds().area() as u64);
            assert!(film.bad_samples().count() > 0);
            assert_eq!(
                n.prepared.into_inner().unwrap(),
                if prepares { [0].into_iter().chain(until.max(1)..6).collect() } else { vec![] }
            );
            (film.develop(), film.bad_samples())
        };
        let one = developed(1);
        for threads in [2, 3, 8] {
            assert!(one == developed(threads), "{threads} threads");
        }
    }
}

#[test]
fn passes_may_be_split_and_merged_in_any_order() {
    let whole = film(gaussian(), true);
    render(&mut Noise { light_blocks: 2, ..noise() }, &whole, Stop::Passes(0..16), 3);

    let part = |range| {
        let film = film(gaussian(), true);
        render(&mut Noise { light_blocks: 2, ..noise() }, &film, Stop::Passes(range), 2);
        film
    };
    let (mut b, a) = (part(8..16), part(0..8));
    b.merge(&a).unwrap();
    assert!(whole.develop() == b.develop());

    // And one film that is extended.
    let film = part(0..5);
    let report = render(&mut Noise { light_blocks: 2, ..noise() }, &film, Stop::Passes(0..16), 2);
    assert_eq!(report.passes, 11);
    assert!(whole.develop() == film.develop());
}

#[test]
fn a_crop_is_a_part_of_the_whole() {
    let whole = film(gaussian(), false);
    render(&mut noise(), &whole, Stop::Passes(0..3), 2);
    let crop = Bounds2i::new([30, 31], [70, 66]);
    let part = Film::new(FilmSettings { crop, ..FilmSettings::new([100, 70], gaussian()) }).unwrap();
    render(&mut noise(), &part, Stop::Passes(0..3), 2);
    let (whole, part) = (whole.develop(), part.develop());
    for (i, (x, y)) in (31..66).flat_map(|y| (30..70).map(move |x| (x, y))).enumerate() {
        assert_eq!(part.mean[i], whole.mean[y * 100 + x]);
        assert_eq!(part.variance[i], whole.variance[y * 100 + x]);
    }
}

#[test]
fn a_time_limit_ends_at_whole_passes_and_has_at_least_one() {
    let slow = || Noise { busy: Duration::from_millis(2), ..noise() };
    let (mut n, film_a) = (slow(), film(Filter::pixel_box(), false));
    let report = render(&mut n, &film_a, Stop::Time(Duration::from_millis(200)), 2);
    assert!(report.passes >= 2 && !report.cancelled);
    assert!(report.elapsed < Duration::from_millis(400), "{:?}", report.elapsed);
    assert_eq!(film_a.passes(), PassSet::from_range(0..report.passes));
    let dropped = n.cells.into_inner() as u32 - report.passes * 12;
    assert!(dropped < 2 * 12, "at most the passes in the works");

    let film_b = film(Filter::pixel_box(), false);
    render(&mut slow(), &film_b, Stop::Passes(0..report.passes), 1);
    assert!(film_a.develop() == film_b.develop());

    let film_c = film(Filter::pixel_box(), false);
    assert_eq!(render(&mut slow(), &film_c, Stop::Time(Duration::ZERO), 2).passes, 1);
}

#[test]
fn a_cancelled_render_keeps_what_is_complete() {
    for (asked, passes_kept) in [(1, 1), (2, 0)] {
        let film = film(Filter::pixel_box(), false);
        let cancel = Cancel::default();
        (0..asked).for_each(|_| cancel.cancel());
        let control = Control { cancel, checkpoint: None, viewer: None, on_event: &mut |_| {} };
        let mut n = Noise { busy: Duration::from_millis(30), ..noise() };
        let report = run(&mut n, &film, &Stop::Passes(0..1000), &workers(2), control).unwrap();
        assert!(report.cancelled);
        assert_eq!((report.passes, film.passes().len()), (passes_kept, u64::from(passes_kept)));
    }
}

#[test]
fn checkpoints_see_whole_passes_while_it_runs() {
    let film = film(gaussian(), true);
    let mut seen = Vec::new();
    let mut save = |film: &Film| {
        // What is developed now must be what those passes alone give.
        seen.push((film.passes().len() as u32, film.develop()));
        Ok(())
    };
    let checkpoint =
        Some(Checkpointer { path: Path::new("c"), every: Duration::from_millis(20), save: &mut save });
    let (mut fractions, mut told) = (Vec::new(), 0);
    let mut on_event = |e: Event<'_>| match e {
        Event::Progress(p) => fractions.push(p.fraction),
        Event::Checkpoint { .. } => told += 1,
        Event::Warning(_) | _ => panic!("{e:?}"),
    };
    let control = Control { cancel: Cancel::default(), checkpoint, viewer: None, on_event: &mut on_event };
    let mut n = Noise { busy: Duration::from_millis(2), light_blocks: 2, ..noise() };
    run(&mut n, &film, &Stop::Passes(0..12), &workers(3), control).unwrap();
    assert!(seen.len() >= 2 && told == seen.len(), "{}", seen.len());
    assert!(fractions.is_sorted() && fractions.len() >= 2);
    for (n_passes, developed) in seen {
        let again = self::film(gaussian(), true);
        render(&mut Noise { light_blocks: 2, ..noise() }, &again, Stop::Passes(0..n_passes), 2);
        assert!(again.develop() == developed);
    }
}

#[test]
fn a_viewer_sees_whole_passes_between_checkpoints() {
    let film = film(gaussian(), true);
    let (mut seen, mut saved) = (Vec::new(), 0);
    let mut show = |film: &Film| seen.push((film.passes().len() as u32, film.develop()));
    let mut save = |_: &Film| {
        saved += 1;
        Ok(())
    };
    let viewer = Some(Viewer { every: Duration::from_millis(15), show: &mut show });
    let checkpoint =
        Some(Checkpointer { path: Path::new("c"), every: Duration::from_millis(60), save: &mut save });
    let control = Control { cancel: Cancel::default(), checkpoint, viewer, on_event: &mut |_| {} };
    let mut n = Noise { busy: Duration::from_millis(2), light_blocks: 2, ..noise() };
    run(&mut n, &film, &Stop::Passes(0..12), &workers(3), control).unwrap();
    assert!(seen.len() >= 2 && saved < seen.len(), "{} and {saved}", seen.len());
    for (n_passes, developed) in seen {
        let again = self::film(gaussian(), true);
        render(&mut Noise { light_blocks: 2, ..noise() }, &again, Stop::Passes(0..n_passes), 2);
        assert!(again.develop() == developed);
    }
}

#[test]
fn a_checkpoint_that_fails_does_not_end_the_render() {
    let film = film(Filter::pixel_box(), false);
    let mut save =
        |_: &Film| Err(steradian_render::Error::Output { path: "x".into(), reason: "disk full".into() });
    let checkpoint =
        Some(Checkpointer { path: Path::new("x"), every: Duration::from_millis(10), save: &mut save });
    let mut warnings = Vec::new();
    let mut on_event = |e: Event<'_>| {
        if let Event::Warning(text) = e {
            warnings.push(text.to_owned());
        }
    };
    let control = Control { cancel: Cancel::default(), checkpoint, viewer: None, on_event: &mut on_event };
    let mut n = Noise { busy: Duration::from_millis(2), ..noise() };
    let report = run(&mut n, &film, &Stop::Passes(0..20), &workers(2), control).unwrap();
    assert_eq!(report.passes, 20);
    assert!(!warnings.is_empty());
    assert!(warnings.iter().all(|w| w == "cannot write x: disk full; the render goes on"));
}

#[test]
fn a_panic_in_a_worker_reaches_the_caller() {
    struct Bug;
    impl Passes for Bug {
        fn prepares(&self) -> bool {
            false
        }
        fn prepare(&mut self, _: u32) -> Prepared {
            Prepared::default()
        }
        fn light_blocks(&self) -> u32 {
            0
        }
        fn cell(&self, pass: u32, _: Cell, _: &mut CellOutput) {
            assert!(pass < 2, "a bug");
        }
    }
    let caught = std::panic::catch_unwind(|| {
        let film = film(Filter::pixel_box(), false);
        let control =
            Control { cancel: Cancel::default(), checkpoint: None, viewer: None, on_event: &mut |_| {} };
        run(&mut Bug, &film, &Stop::Passes(0..1000), &workers(3), control).map(|r| r.passes)
    });
    assert!(caught.is_err());
}

#[test]
fn what_is_prepared_counts_and_warns_once() {
    let film = film(Filter::pixel_box(), false);
    let mut warnings = 0;
    let mut on_event = |e: Event<'_>| warnings += u32::from(matches!(e, Event::Warning("odd")));
    let control =
        Control { cancel: Cancel::default(), checkpoint: None, viewer: None, on_event: &mut on_event };
    let mut n = Noise { prepares: true, ..noise() };
    let report = run(&mut n, &film, &Stop::Passes(0..5), &workers(2), control).unwrap();
    assert_eq!((report.counters.rays, warnings), (5, 1));
}

#[test]
fn counters_add_up() {
    let a = Counters { rays: 1, camera_paths: 2, light_paths: 3 };
    let mut b = a;
    b.add(&a);
    assert_eq!(b, Counters { rays: 2, camera_paths: 4, light_paths: 6 });
}
