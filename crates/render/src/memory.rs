//! Memory: what a render will need, and what there is, so that a huge film is refused with a sentence instead of taking the
//! machine down.

use std::fs;
use std::path::Path;

use film::FilmSettings;

use crate::Error;

/// Bytes of a sum of three channels, of a sum of their squares, and of a weight, as long as their numbers are no larger than usual.
const SUM: u64 = 36;
const SQUARES: u64 = 24;
const WEIGHT: u64 = 8;

/// Refuses a film that this machine has no memory for. Where the system does not say what it has, nothing is refused.
pub(crate) fn check(settings: &FilmSettings, buffers: u64) -> Result<(), Error> {
    let needed = needed(settings, buffers);
    let [width, height] = [settings.crop.width(), settings.crop.height()];
    match available() {
        Some(available) if needed > available => Err(Error::Memory { width, height, needed, available }),
        Some(_) | None => Ok(()),
    }
}

/// Bytes of film, pass buffers and finished picture.
fn needed(settings: &FilmSettings, buffers: u64) -> u64 {
    let is_weighted = !settings.filter.is_pixel_box();
    let (weighted, splats) = (u64::from(is_weighted), u64::from(is_weighted && settings.splats));
    let aovs = (settings.aovs.len() + settings.splat_aovs.len()) as u64;
    let film = SUM + SQUARES + weighted * (SQUARES + 2 * WEIGHT) + splats * SUM + aovs * 12;
    let buffer = SUM + weighted * WEIGHT + splats * SUM + aovs * 12;
    // Developed, and as an image with its variance.
    let picture = 2 * (2 * 12 + aovs * 4);
    let films = film * (settings.iterations.len() as u64 + 1);
    (films + buffers * buffer + picture).saturating_mul(settings.crop.area() as u64)
}

/// Bytes that can be had without swapping, as far as the system says: the machine's, or the container's.
fn available() -> Option<u64> {
    let machine = fs::read_to_string("/proc/meminfo").ok().and_then(|text| meminfo(&text));
    let group = Path::new("/sys/fs/cgroup");
    let number = |file: &str| fs::read_to_string(group.join(file)).ok()?.trim().parse::<u64>().ok();
    let container =
        number("memory.max").zip(number("memory.current")).map(|(max, used)| max.saturating_sub(used));
    machine.into_iter().chain(container).min()
}

fn meminfo(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;
    use film::Filter;

    #[test]
    fn the_systems_words_are_understood() {
        assert_eq!(meminfo("MemTotal: 9 kB\nMemAvailable:   123 kB\n"), Some(123 * 1024));
        assert_eq!(meminfo("MemTotal: 9 kB\n"), None);
    }

    #[test]
    fn only_what_cannot_be_held_is_refused() {
        let film = |side| FilmSettings::new([side, side], Filter::gaussian());
        assert!(check(&film(64), 2).is_ok());
        // 2⁴⁰ pixels are some 300 TB.
        if available().is_some() {
            let e = check(&film(1 << 20), 2).unwrap_err();
            assert!(e.is_input() && e.to_string().contains("GiB"), "{e}");
        }
    }
}
