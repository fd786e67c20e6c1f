//! Partial files: nothing changes on the way, and nothing that is read is trusted.

#![expect(clippy::unwrap_used, reason = "helpers of tests are tests")]

use math::Bounds2i;
use proptest::prelude::*;
use steradian_film::{Error, Film, FilmSettings, Filter, Merged, RenderKey, Sign};

fn small(filter: Filter) -> Film {
    of_passes(filter, &[0, 1, 7])
}

fn of_passes(filter: Filter, passes: &[u32]) -> Film {
    let film = Film::new(FilmSettings {
        resolution: [40, 3],
        crop: Bounds2i::new([1, 0], [40, 2]),
        filter,
        sign: Sign::Any,
        splats: true,
        aovs: vec!["depth.Z".into()],
        splat_aovs: ["R", "G", "B"].map(|c| format!("s2t1.{c}")).to_vec(),
        iterations: vec![1, 5],
        key: RenderKey {
            scene: "c0ffee".into(),
            integrator: "path".into(),
            settings: "max_depth=5 \"quoted\"".into(),
            seed: u64::MAX,
        },
    })
    .unwrap();
    let (mut buffer, mut tile, mut list) = (film.pass_buffer().unwrap(), film.tile(), film.splat_list());
    for &pass in passes {
        buffer.begin(pass);
        tile.begin(film.settings().sample_bounds(), pass);
        for x in 0..40 {
            tile.add_sample([x, 1], [0.3, 0.8], [0.1 * x as f32, -1e-9, 1e9]);
            tile.add_aovs([x, 1], [0.3, 0.8], &[x as f32]);
        }
        tile.add_sample([3, 0], [0.5; 2], [f32::NAN; 3]);
        list.begin(pass);
        list.add([20.3, 0.6], [1.0, 2.0, 3.0]);
        list.add_aov(0, [21.3, 1.6], [4.0, 5.0, 6.0]);
        buffer.add_tile(&tile);
        buffer.add_splats(&mut list);
        film.add_pass(&mut buffer).unwrap();
    }
    film
}

fn refusal(bytes: &[u8]) -> Error {
    match Film::from_bytes(bytes) {
        Ok(_) => panic!("bytes that are no partial film were taken for one"),
        Err(e) => e,
    }
}

#[test]
fn what_is_written_is_read() {
    for filter in
        [Filter::pixel_box(), Filter::gaussian(), Filter::sinc(), Filter::Box { radius: [0.7, 0.1] }]
    {
        let film = small(filter);
        let bytes = film.to_bytes().unwrap();
        let back = Film::from_bytes(&bytes).unwrap();
        assert_eq!(back.settings(), film.settings());
        assert_eq!(back.passes().to_string(), "0..2,7..8");
        assert_eq!(back.bad_samples(), film.bad_samples());
        assert_eq!(back.develop(), film.develop());
        assert!(back.to_bytes().unwrap() == bytes);
    }
}

#[test]
fn bytes_are_merged_as_their_film_is() {
    for filter in [Filter::pixel_box(), Filter::gaussian()] {
        let other = of_passes(filter, &[2, 6]);
        let (mut one, mut two) = (small(filter), small(filter));
        assert_eq!(one.merge(&other).unwrap(), Merged::Added);
        assert_eq!(two.merge_bytes(&other.to_bytes().unwrap()).unwrap(), Merged::Added);
        let whole = one.to_bytes().unwrap();
        assert!(two.to_bytes().unwrap() == whole);
        // What cannot be added changes nothing.
        let mut damaged = other.to_bytes().unwrap();
        *damaged.last_mut().unwrap() ^= 1;
        assert_eq!(two.merge_bytes(&other.to_bytes().unwrap()).unwrap(), Merged::AlreadyThere);
        assert!(matches!(two.merge_bytes(&damaged), Err(Error::Checksum)));
        let overlapping = of_passes(filter, &[7, 8]).to_bytes().unwrap();
        assert!(matches!(two.merge_bytes(&overlapping), Err(Error::Overlap { .. })));
        assert!(two.to_bytes().unwrap() == whole);
    }
}

#[test]
fn files_appear_whole_and_errors_name_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.safetensors");
    let film = small(Filter::mitchell());
    film.save(&path).unwrap();
    film.save(&path).unwrap();
    assert!(std::fs::read(&path).unwrap() == film.to_bytes().unwrap());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file is left");
    assert_eq!(Film::load(&path).unwrap().develop(), film.develop());

    std::fs::write(&path, b"P6 3 3 255 ").unwrap();
    let message = Film::load(&path).err().unwrap().to_string();
    assert!(message.contains("part.safetensors") && message.contains("not a partial film"), "{message}");
    assert!(Film::load(folder.path().join("none")).is_err());
    assert!(film.save(folder.path().join("no/such/folder/x")).is_err());
}

#[test]
fn other_versions_are_named() {
    // The same length, so that only the version differs.
    let bytes = small(Filter::pixel_box()).to_bytes().unwrap();
    let old = br#"\"version\":1"#;
    let at = bytes.windows(old.len()).position(|w| w == old).unwrap();
    let mut other = bytes;
    other[at + old.len() - 1] = b'2';
    let message = refusal(&other).to_string();
    assert!(
        message.contains("version 2") && message.contains("reads `steradian partial film` version 1"),
        "{message}"
    );
}

#[test]
fn every_truncation_is_refused() {
    let bytes = small(Filter::gaussian()).to_bytes().unwrap();
    for n in (0..2000).chain((2000..bytes.len()).step_by(101)) {
        let _ = refusal(&bytes[..n]);
    }
    let mut longer = bytes;
    longer.push(0);
    let _ = refusal(&longer);
}

#[test]
fn every_flipped_bit_of_the_sums_is_found() {
    let bytes = small(Filter::gaussian()).to_bytes().unwrap();
    let header = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    for at in (8 + header..bytes.len()).step_by(37) {
        let mut changed = bytes.clone();
        changed[at] ^= 1 << (at % 8);
        assert!(matches!(refusal(&changed), Error::Checksum), "byte {at}");
    }
}

#[test]
fn huge_claims_cost_nothing() {
    let file =
        |header: &str| [&(header.len() as u64).to_le_bytes()[..], header.as_bytes(), &[0; 64]].concat();
    let max = u64::MAX;
    for header in [
        format!(r#"{{"total":{{"dtype":"U64","shape":[{max}],"data_offsets":[0,{max}]}}}}"#),
        format!(r#"{{"total":{{"dtype":"U8","shape":[{max}],"data_offsets":[0,{}]}}}}"#, max - 3),
        r#"{"total":{"dtype":"U8","shape":[4294967296,4294967296,2],"data_offsets":[0,64]}}"#.into(),
        r#"{"a":{"dtype":"U8","shape":[64],"data_offsets":[0,64]}}"#.into(),
        "[".repeat(100_000),
        "{}".into(),
    ] {
        let _ = refusal(&file(&header));
    }
    for n in [0, 1, 7, u64::MAX, 1 << 40] {
        let _ = refusal(&[&n.to_le_bytes()[..], b"{}"].concat());
    }
    // A film of a terapixel in the metadata, and arrays of 39 × 2.
    let bytes = small(Filter::pixel_box()).to_bytes().unwrap();
    for (from, to) in
        [(r#"[40,3]"#, r#"[99,9]"#), (r#"[1,0,40,2]"#, r#"[1,0,40,3]"#), (r#"[1,0,40,2]"#, r#"[9,9,-1,2]"#)]
    {
        let at = bytes.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        let mut changed = bytes.clone();
        changed[at..at + from.len()].copy_from_slice(to.as_bytes());
        let _ = refusal(&changed);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn junk_never_panics(junk in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = refusal(&junk);
    }

    #[test]
    fn a_mangled_header_never_panics(edits in prop::collection::vec((0_usize..1500, any::<u8>()), 1..4)) {
        let bytes = small(Filter::gaussian()).to_bytes().unwrap();
        let mut changed = bytes.clone();
        for (at, b) in edits {
            let at = at % changed.len();
            changed[at] = b;
        }
        // Whitespace in the header carries no meaning; anything else must be refused or mean the same film.
        if let Ok(film) = Film::from_bytes(&changed) {
            prop_assert!(film.to_bytes().unwrap() == bytes);
        }
    }
}
