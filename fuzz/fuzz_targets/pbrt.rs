//! pbrt-v4 and pbrt-v3 scenes.
#![cfg_attr(feature = "libfuzzer", no_main)]

mod common;

target!(|bytes: &[u8]| common::read("a.pbrt", &[("a.pbrt", bytes)]));
