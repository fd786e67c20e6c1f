//! "Did you mean …?": the nearest of the names that were possible.

/// The candidate that `word` was most likely meant to be, if any is near.
pub(crate) fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = word.to_lowercase();
    candidates
        .into_iter()
        .filter(|c| !c.is_empty() && *c != word)
        .map(|c| (strsim::jaro_winkler(&lower, &c.to_lowercase()), c))
        .filter(|(likeness, _)| *likeness > 0.82)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, c)| c)
}

/// ``did you mean `x`?``, or what else is possible.
pub(crate) fn hint(word: &str, candidates: &[&str]) -> String {
    match nearest(word, candidates.iter().copied()) {
        Some(c) => format!("did you mean \"{c}\"?"),
        None if candidates.len() == 1 => format!("there is only {}", listing(candidates)),
        None => format!("possible are {}", listing(candidates)),
    }
}

/// `"a", "b" and "c"`, cut short where there are many.
pub(crate) fn listing(names: &[&str]) -> String {
    const MOST: usize = 12;
    let quoted: Vec<_> = names.iter().take(MOST).map(|n| format!("\"{n}\"")).collect();
    match (names.len() > MOST, quoted.split_last()) {
        (true, _) => format!("{}, …", quoted.join(", ")),
        (false, Some((last, rest))) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        (false, _) => quoted.join(""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_the_finger_is_understood() {
        let names = ["Shape", "Scale", "Sampler"];
        assert_eq!(nearest("Shpae", names), Some("Shape"));
        assert_eq!(nearest("sampler", names), Some("Sampler"));
        assert_eq!(nearest("Xyzzy", names), None);
        assert_eq!(hint("q", &["a", "b", "c"]), "possible are \"a\", \"b\" and \"c\"");
    }
}
