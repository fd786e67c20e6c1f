//! Photometric files of lamps: IES LM-63 of 1986, 1991, 1995, 2002 and 2019 [IES2002].
//!
//! A head of free lines up to `TILT=`, then numbers: ten about the lamp, three about its ballast, the vertical angles,
//! the horizontal ones, and for each horizontal angle the candela over the vertical ones. Numbers stand apart by spaces,
//! commas and line ends alike; nothing is made of where lines end.
//!
//! Read is photometry of type C (the pole straight down), which nearly all files have. Left out, and refused by name: types A
//! and B, tables of tilt. Not used: watts, and the size of the opening (a light of ours is a point).

use std::path::Path;

/// Larger files are none.
const MOST_BYTES: u64 = 16 << 20;

/// What a file says: candela over two angles in degrees.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Photometry {
    /// From straight down (0) to straight up (180); ascending.
    pub(super) vertical: Vec<f32>,
    /// Around, within [0, 360], as measured: symmetries are not unfolded; ascending.
    pub(super) horizontal: Vec<f32>,
    /// For each horizontal angle, the candela over the vertical ones.
    pub(super) candela: Vec<f32>,
}

/// Reads a file; the error begins with the file's name, and the line and column where there is one.
pub(super) fn load(path: &Path) -> Result<Photometry, String> {
    let name = path.display();
    let meta = std::fs::metadata(path).map_err(|e| format!("{name} cannot be read: {e}"))?;
    if meta.len() > MOST_BYTES {
        return Err(format!("{name} has {} bytes: no photometric file is so large", meta.len()));
    }
    let bytes = std::fs::read(path).map_err(|e| format!("{name} cannot be read: {e}"))?;
    parse(&String::from_utf8_lossy(&bytes)).map_err(|e| format!("{name}:{}:{}: {}", e.line, e.column, e.what))
}

/// What is wrong with a file, and where: line and column from 1.
#[derive(Debug, PartialEq, Eq)]
struct Wrong {
    line: usize,
    column: usize,
    what: String,
}

fn parse(text: &str) -> Result<Photometry, Wrong> {
    let mut numbers = Numbers::after_head(text)?;
    let factor = numbers.lamp()?;
    let [n_vertical, n_horizontal] = factor.counts;

    let vertical = numbers.angles(n_vertical, "vertical angle", 180.0)?;
    let (first, last) = (vertical[0], vertical[n_vertical - 1]);
    if ![0.0, 90.0].contains(&first) || ![90.0, 180.0].contains(&last) || first == last {
        return Err(numbers.wrong(format!(
            "vertical angles run from {first} to {last}: expected 0 or 90 to 90 or 180 degrees"
        )));
    }
    let horizontal = numbers.angles(n_horizontal, "horizontal angle", 360.0)?;
    let (first, last) = (horizontal[0], horizontal[n_horizontal - 1]);
    if ![[0.0, 0.0], [0.0, 90.0], [0.0, 180.0], [0.0, 360.0], [90.0, 270.0]].contains(&[first, last]) {
        return Err(numbers.wrong(format!(
            "horizontal angles run from {first} to {last}: expected 0 alone, 0 to 90, 180 or 360, or 90 to 270 degrees"
        )));
    }

    if first == 90.0 && !horizontal.contains(&180.0) {
        return Err(numbers.wrong("horizontal angles from 90 to 270 without 180".to_owned()));
    }

    let mut candela = Vec::new();
    for _ in 0..n_vertical * n_horizontal {
        let value = numbers.next("a candela value")?;
        if value < 0.0 {
            return Err(numbers.wrong(format!("a candela value of {value}: expected none below 0")));
        }
        candela.push((value * factor.of_candela) as f32);
    }
    if candela.iter().any(|c| !c.is_finite()) {
        return Err(numbers.wrong("candela that no number of 32 bits holds".to_owned()));
    }
    match numbers.token() {
        Some(rest) => Err(numbers.wrong(format!("`{rest}` behind the last candela value"))),
        None => Ok(Photometry { vertical, horizontal, candela }),
    }
}

/// What the first thirteen numbers are good for.
struct Lamp {
    /// Of vertical and horizontal angles.
    counts: [usize; 2],
    /// On every candela value.
    of_candela: f64,
}

/// The words behind the head.
struct Numbers<'t> {
    text: &'t str,
    /// Where the next word is looked for, in bytes.
    at: usize,
    /// Where the last word began.
    word: usize,
}

impl<'t> Numbers<'t> {
    fn after_head(text: &'t str) -> Result<Self, Wrong> {
        let mut numbers = Self { text, at: 0, word: 0 };
        let first = text.lines().next().unwrap_or("").trim();
        let known = ["91", ":LM-63-1986", ":LM-63-1991", ":LM-63-1995", ":LM-63-2002"];
        let is_known = first.strip_prefix("IESNA").is_none_or(|v| known.contains(&v.trim()));
        if !is_known || first.starts_with("IES:") && first != "IES:LM-63-2019" {
            return Err(numbers.wrong(format!("a file of `{first}`: expected LM-63 of 1986 to 2019")));
        }
        for line in text.split_inclusive('\n') {
            numbers.word = numbers.at;
            numbers.at += line.len();
            let Some(tilt) = line.trim_start().strip_prefix("TILT=") else { continue };
            return match tilt.trim() {
                "NONE" => Ok(numbers),
                "INCLUDE" => {
                    Err(numbers.wrong("lamps whose tilt has a table (TILT=INCLUDE) are not supported".into()))
                }
                file => {
                    Err(numbers
                        .wrong(format!("lamps whose tilt has a table (TILT={file}) are not supported")))
                }
            };
        }
        Err(numbers.wrong("no line that begins with TILT=: is this a photometric file?".to_owned()))
    }

    /// The numbers about the lamp and its ballast.
    fn lamp(&mut self) -> Result<Lamp, Wrong> {
        self.next("the number of lamps")?;
        self.next("the lumens of a lamp")?;
        let multiplier = self.positive("the candela multiplier")?;
        let counts = [
            self.count("the number of vertical angles", 2)?,
            self.count("the number of horizontal angles", 1)?,
        ];
        match self.next("the type of photometry")? {
            1.0 => {}
            2.0 => {
                return Err(self.wrong("photometry of type B is not supported, only type C (1)".to_owned()));
            }
            3.0 => {
                return Err(self.wrong("photometry of type A is not supported, only type C (1)".to_owned()));
            }
            other => return Err(self.wrong(format!("photometry of type {other}: expected 1 (type C)"))),
        }
        for what in
            ["the unit of length", "the opening's width", "the opening's length", "the opening's height"]
        {
            self.next(what)?;
        }
        let ballast = self.positive("the ballast factor")?;
        // For future use since 1995; before, the ballast–lamp photometric factor.
        let photometric = self.positive("the ballast–lamp photometric factor")?;
        self.next("the input watts")?;
        Ok(Lamp { counts, of_candela: multiplier * ballast * photometric })
    }

    fn angles(&mut self, n: usize, what: &str, most: f32) -> Result<Vec<f32>, Wrong> {
        let mut angles: Vec<f32> = Vec::new();
        for _ in 0..n {
            let angle = self.next(what)? as f32;
            if !(0.0..=most).contains(&angle) {
                return Err(self.wrong(format!("a {what} of {angle}: expected 0 to {most} degrees")));
            }
            if let Some(last) = angles.last().filter(|last| **last >= angle) {
                return Err(self.wrong(format!("a {what} of {angle} after {last}: expected a larger one")));
            }
            angles.push(angle);
        }
        Ok(angles)
    }

    fn count(&mut self, what: &str, least: usize) -> Result<usize, Wrong> {
        let n = self.next(what)?;
        // A number takes two bytes at least: what the file cannot hold is not looked for.
        let most = self.text.len() / 2;
        if n.fract() != 0.0 || n < least as f64 || n > most as f64 {
            return Err(self.wrong(format!(
                "{what} is {n}: expected a whole number from {least} up, and a file that long"
            )));
        }
        Ok(n as usize)
    }

    fn positive(&mut self, what: &str) -> Result<f64, Wrong> {
        let x = self.next(what)?;
        if x > 0.0 { Ok(x) } else { Err(self.wrong(format!("{what} is {x}: expected a number above 0"))) }
    }

    fn next(&mut self, what: &str) -> Result<f64, Wrong> {
        let Some(word) = self.token() else {
            return Err(self.wrong(format!("the file ends: expected {what}")));
        };
        match word.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(x),
            Ok(_) | Err(_) => Err(self.wrong(format!("`{word}`: expected {what}"))),
        }
    }

    fn token(&mut self) -> Option<&'t str> {
        let is_gap = |c: char| c.is_whitespace() || c == ',' || c == '\u{1a}';
        let rest = &self.text[self.at..];
        let word = rest.trim_start_matches(is_gap);
        self.word = self.at + rest.len() - word.len();
        let n = word.find(is_gap).unwrap_or(word.len());
        self.at = self.word + n;
        (n > 0).then(|| &word[..n])
    }

    /// At the last word.
    fn wrong(&self, what: String) -> Wrong {
        let before = &self.text[..self.word];
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
        Wrong { line, column, what }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "IESNA:LM-63-2002\r\n[TEST] none\n[MORE] TILT is below\nTILT=NONE\n\
        1 1000 2 3 2 1 1 0 0 0\n0.5, 1.0, 40\n0 45 90\n0 90\n100 50 0\n80 40\n 20\n";

    #[test]
    fn numbers_are_read_across_lines_and_multiplied() {
        let p = parse(GOOD).unwrap();
        assert_eq!((p.vertical, p.horizontal), (vec![0.0, 45.0, 90.0], vec![0.0, 90.0]));
        assert_eq!(p.candela, [100.0, 50.0, 0.0, 80.0, 40.0, 20.0]);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let say = |from: &str, to: &str| {
            let e = parse(&GOOD.replacen(from, to, 1)).unwrap_err();
            format!("{}:{}: {}", e.line, e.column, e.what)
        };
        let told = [
            say("IESNA:LM-63-2002", "IESNA:LM-63-2099"),
            say("TILT=NONE", "TILT=INCLUDE"),
            say("TILT=NONE", ""),
            say("3 2 1 1", "3 2 3 1"),
            say("3 2 1 1", "1e9 2 1 1"),
            say("3 2 1 1", "2.5 2 1 1"),
            say("0 45 90", "0 45 45"),
            say("0 45 90", "0 45 80"),
            say("\n0 90\n", "\n0 270\n"),
            say("80 40", "80 forty"),
            say("80 40", "80 -40"),
            say(" 20\n", ""),
            say(" 20\n", " 20 7\n"),
            say("1000 2 3", "1000 nan 3"),
        ];
        assert_eq!(
            told.join("\n"),
            "1:1: a file of `IESNA:LM-63-2099`: expected LM-63 of 1986 to 2019\n\
             4:1: lamps whose tilt has a table (TILT=INCLUDE) are not supported\n\
             11:1: no line that begins with TILT=: is this a photometric file?\n\
             5:14: photometry of type A is not supported, only type C (1)\n\
             5:10: the number of vertical angles is 1000000000: expected a whole number from 2 up, and a file that long\n\
             5:10: the number of vertical angles is 2.5: expected a whole number from 2 up, and a file that long\n\
             7:6: a vertical angle of 45 after 45: expected a larger one\n\
             7:6: vertical angles run from 0 to 80: expected 0 or 90 to 90 or 180 degrees\n\
             8:3: horizontal angles run from 0 to 270: expected 0 alone, 0 to 90, 180 or 360, or 90 to 270 degrees\n\
             10:4: `forty`: expected a candela value\n\
             10:4: a candela value of -40: expected none below 0\n\
             11:1: the file ends: expected a candela value\n\
             11:5: `20` behind the last candela value"
                .replace("11:5: `20`", "11:5: `7`")
                + "\n5:8: `nan`: expected the candela multiplier"
        );
    }

    #[test]
    fn any_bytes_are_an_error_and_no_panic() {
        for n in 0..GOOD.len() {
            assert!(
                GOOD.is_char_boundary(n) && (parse(&GOOD[..n]).is_err() || n >= GOOD.trim_end().len() - 1)
            );
        }
        assert!(parse("").is_err() && parse("TILT=NONE\n\u{fffd}").is_err());
    }
}
