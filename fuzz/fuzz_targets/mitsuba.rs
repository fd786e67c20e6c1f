//! Mitsuba scenes.
#![cfg_attr(feature = "libfuzzer", no_main)]

mod common;

target!(|bytes: &[u8]| common::read("a.xml", &[("a.xml", bytes)]));
