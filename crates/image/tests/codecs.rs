//! Files there and back, real files, and broken ones.

use std::path::Path;

use steradian_image::{
    Format, Image, MetaValue, SaveOptions, decode, decode_image, encode, load, load_image, save,
};

fn sample(width: usize, height: usize) -> Image {
    let mut image = Image::new(width, height, &["R", "G", "B"]);
    for (i, v) in image.data_mut().iter_mut().enumerate() {
        *v = math::trig::sin(i as f32 * 0.137).abs() * 3.0;
    }
    image
}

#[test]
fn exr_keeps_channels_notes_and_every_bit() {
    let mut image = sample(37, 41);
    let mut extra = sample(37, 41);
    extra.data_mut()[0] = f32::NAN;
    extra.data_mut()[1] = f32::NEG_INFINITY;
    extra.data_mut()[2] = -0.0;
    image.append("variance.", &extra).unwrap();
    let notes = [
        ("steradian.integrator", MetaValue::Text("path".into())),
        ("steradian.seed", MetaValue::Text("18446744073709551615".into())),
        ("steradian.passes", MetaValue::Int(64)),
        ("steradian.seconds", MetaValue::Double(1.5e-9)),
        (
            "chromaticities",
            MetaValue::Chromaticities([[0.64, 0.33], [0.3, 0.6], [0.15, 0.06], [0.3127, 0.329]]),
        ),
        ("a note with a name that is longer than thirty-one bytes", MetaValue::Text("as it is".into())),
    ];
    image.metadata.extend(notes.map(|(k, v)| (k.to_owned(), v)));

    let bytes = encode(&image, Format::Exr, &SaveOptions::default()).unwrap();
    let back = decode_image(&bytes, None).unwrap();
    for (c, name) in image.channels().iter().enumerate() {
        let d = back.channel(name).unwrap();
        for y in 0..41 {
            for x in 0..37 {
                assert_eq!(image.pixel(x, y)[c].to_bits(), back.pixel(x, y)[d].to_bits(), "{name} {x} {y}");
            }
        }
    }
    for (name, value) in &image.metadata {
        assert_eq!(back.metadata.get(name), Some(value), "{name}");
    }
    assert_eq!(bytes, encode(&image, Format::Exr, &SaveOptions::default()).unwrap());
}

#[test]
fn an_exr_crop_knows_its_place() {
    let full = sample(20, 30);
    let crop = full.crop(math::Bounds2i { min: [3, 5], max: [19, 29] }).unwrap();
    let bytes = encode(&crop, Format::Exr, &SaveOptions::default()).unwrap();
    let back = decode_image(&bytes, None).unwrap().to_rgb().unwrap();
    assert_eq!((back.origin, back.full_size, back.width(), back.height()), ([3, 5], [20, 30], 16, 24));
    assert_eq!(back.data(), crop.data());
}

#[test]
fn exr_refuses_what_it_cannot_hold() {
    let mut twice = sample(2, 2);
    twice.append("", &sample(2, 2)).unwrap();
    assert!(
        encode(&twice, Format::Exr, &SaveOptions::default())
            .unwrap_err()
            .to_string()
            .contains("two channels")
    );
    let mut image = sample(2, 2);
    image.metadata.insert("dataWindow".into(), MetaValue::Int(1));
    assert!(encode(&image, Format::Exr, &SaveOptions::default()).is_err());
    assert!(encode(&Image::new(0, 0, &["R"]), Format::Exr, &SaveOptions::default()).is_err());
}

#[test]
fn files_are_saved_by_their_ending() {
    let folder = tempfile::tempdir().unwrap();
    let image = sample(9, 4);
    for ending in ["exr", "png", "hdr", "pfm", "EXR"] {
        let path = folder.path().join(format!("a.{ending}"));
        save(&path, &image, &SaveOptions::default()).unwrap();
        let back = load_image(&path).unwrap().to_rgb().unwrap();
        assert_eq!((back.width(), back.height()), (9, 4));
        for (a, b) in image.data().iter().zip(back.data()) {
            assert!((a.min(if ending == "png" { 1.0 } else { 9.0 }) - b).abs() < 0.02, "{ending} {a} {b}");
        }
    }
    let error = save(&folder.path().join("a.gif"), &image, &SaveOptions::default()).unwrap_err();
    assert!(error.to_string().contains(".exr, .png, .hdr and .pfm"), "{error}");
    let error = load(&folder.path().join("none.png")).unwrap_err();
    assert!(error.to_string().contains("cannot read"), "{error}");
}

/// A hash of the case's number: no randomness, the same cases in every run.
fn number(seed: u32) -> usize {
    math::hash::mix32(seed) as usize
}

/// Every file with bytes changed, cut off or doubled gives pixels or an error, never a panic.
#[test]
fn broken_files_are_errors() {
    use codecs::ImageEncoder;
    let image = sample(19, 23);
    let mut files: Vec<(Format, Vec<u8>)> = [Format::Exr, Format::Png, Format::Hdr, Format::Pfm]
        .map(|f| (f, encode(&image, f, &SaveOptions::default()).unwrap()))
        .into();
    let pixels: Vec<u8> = (0..19 * 23 * 3).map(|i| number(i) as u8).collect();
    let mut bytes = Vec::new();
    codecs::codecs::jpeg::JpegEncoder::new(&mut bytes)
        .encode(&pixels, 19, 23, codecs::ExtendedColorType::Rgb8)
        .unwrap();
    files.push((Format::Jpeg, bytes));
    let mut bytes = Vec::new();
    codecs::codecs::tga::TgaEncoder::new(&mut bytes)
        .write_image(&pixels, 19, 23, codecs::ExtendedColorType::Rgb8)
        .unwrap();
    files.push((Format::Tga, bytes));
    let mut bytes = Vec::new();
    codecs::codecs::bmp::BmpEncoder::new(&mut bytes)
        .write_image(&pixels, 19, 23, codecs::ExtendedColorType::Rgb8)
        .unwrap();
    files.push((Format::Bmp, bytes));

    for (format, good) in files {
        let name = format!("x.{}", format.name().to_ascii_lowercase());
        let name = Some(Path::new(&name));
        assert!(decode(&good, name).is_ok(), "{format:?}");
        for case in 0..250_u32 {
            let mut bad = good.clone();
            for k in 0..=case % 4 {
                // Most changes in the header, where they hurt.
                let range = if case % 3 == 0 { bad.len() } else { bad.len().min(400) };
                bad[number(case * 31 + k) % range] = number(case * 17 + k + 5) as u8;
            }
            if case % 5 == 0 {
                bad.truncate(number(case) % bad.len());
            }
            let _ = decode(&bad, name);
            let _ = decode_image(&bad, name);
        }
        for len in (0..good.len().min(600)).step_by(7) {
            assert!(decode(&good[..len], name).is_err(), "{format:?} cut to {len}");
        }
    }
}

#[test]
fn noise_is_no_image() {
    for case in 0..50 {
        let noise: Vec<u8> = (0..200).map(|i| number(case * 1000 + i) as u8).collect();
        for name in ["a.png", "a.tga", "a.exr", "a.pfm", "a.hdr", "a.bmp", "a.jpg", "a"] {
            let _ = decode(&noise, Some(Path::new(name)));
        }
    }
    assert!(decode(b"", None).is_err());
}
