//! Floats with named channels.

use std::collections::BTreeMap;

use math::Bounds2i;

use crate::ImageError;

/// A note in an image file.
#[derive(Clone, Debug, PartialEq)]
pub enum MetaValue {
    /// Words.
    Text(String),
    /// A whole number (those beyond 32 bits go as text).
    Int(i32),
    /// A number.
    Double(f64),
    /// The chromaticities (x, y) of R, G, B and white.
    Chromaticities([[f32; 2]; 4]),
}

/// Linear values, row by row from the top left, the channels of a pixel together.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    channels: Vec<String>,
    data: Vec<f32>,
    /// Where pixel (0, 0) lies in the full picture of which this may be a crop.
    pub origin: [i32; 2],
    /// Width and height of the full picture.
    pub full_size: [usize; 2],
    /// Notes, kept by OpenEXR files.
    pub metadata: BTreeMap<String, MetaValue>,
}

impl Image {
    /// All zero.
    #[must_use]
    pub fn new(width: usize, height: usize, channels: &[&str]) -> Self {
        let channels: Vec<String> = channels.iter().map(|c| (*c).to_owned()).collect();
        let data = vec![0.0; width * height * channels.len()];
        Self {
            width,
            height,
            channels,
            data,
            origin: [0; 2],
            full_size: [width, height],
            metadata: BTreeMap::new(),
        }
    }

    /// From values in the order of the type.
    ///
    /// # Errors
    /// [`ImageError::Shape`] when their number is not width × height × channels.
    pub fn from_data(
        width: usize,
        height: usize,
        channels: Vec<String>,
        data: Vec<f32>,
    ) -> Result<Self, ImageError> {
        let expected = width.checked_mul(height).and_then(|n| n.checked_mul(channels.len()));
        if expected != Some(data.len()) {
            return Err(ImageError::Shape { width, height, channels: channels.len(), values: data.len() });
        }
        let full_size = [width, height];
        Ok(Self { width, height, channels, data, origin: [0; 2], full_size, metadata: BTreeMap::new() })
    }

    /// In pixels.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// In pixels.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// Their names, in the order of the values of a pixel.
    #[must_use]
    pub fn channels(&self) -> &[String] {
        &self.channels
    }

    /// Position of a channel.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|c| c == name)
    }

    /// All values.
    #[must_use]
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// All values.
    #[must_use]
    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }

    /// The values alone.
    #[must_use]
    pub fn into_data(self) -> Vec<f32> {
        self.data
    }

    /// One value; `None` outside.
    #[must_use]
    pub fn get(&self, x: usize, y: usize, channel: usize) -> Option<f32> {
        (x < self.width && y < self.height && channel < self.channels.len())
            .then(|| self.pixel(x, y)[channel])
    }

    /// The values of a pixel, which must be inside.
    #[must_use]
    pub fn pixel(&self, x: usize, y: usize) -> &[f32] {
        let n = self.channels.len();
        let at = (y * self.width + x) * n;
        &self.data[at..at + n]
    }

    /// The values of a pixel, which must be inside.
    pub fn pixel_mut(&mut self, x: usize, y: usize) -> &mut [f32] {
        let n = self.channels.len();
        let at = (y * self.width + x) * n;
        &mut self.data[at..at + n]
    }

    /// The rectangle in this image's own pixels.
    ///
    /// # Errors
    /// [`ImageError::CropOutside`] when it is empty or not wholly inside.
    pub fn crop(&self, rect: Bounds2i) -> Result<Self, ImageError> {
        let [x0, y0, x1, y1] = [rect.min[0], rect.min[1], rect.max[0], rect.max[1]];
        let fits = 0 <= x0
            && x0 < x1
            && x1 as usize <= self.width
            && 0 <= y0
            && y0 < y1
            && y1 as usize <= self.height;
        if !fits {
            let (width, height) = (self.width, self.height);
            return Err(ImageError::CropOutside { crop: [x0, y0, x1, y1], width, height });
        }
        let n = self.channels.len();
        let row = |y: i32| {
            let start = y as usize * self.width;
            &self.data[(start + x0 as usize) * n..(start + x1 as usize) * n]
        };
        Ok(Self {
            width: (x1 - x0) as usize,
            height: (y1 - y0) as usize,
            channels: self.channels.clone(),
            data: (y0..y1).flat_map(row).copied().collect(),
            origin: [self.origin[0] + x0, self.origin[1] + y0],
            full_size: self.full_size,
            metadata: self.metadata.clone(),
        })
    }

    /// The named channels alone, in that order.
    ///
    /// # Errors
    /// [`ImageError::NoChannel`] when one is not there.
    pub fn select(&self, names: &[&str]) -> Result<Self, ImageError> {
        let find = |name: &&str| {
            let missing =
                || ImageError::NoChannel { wanted: (*name).to_owned(), have: self.channels.clone() };
            self.channel(name).ok_or_else(missing)
        };
        let at: Vec<usize> = names.iter().map(find).collect::<Result<_, _>>()?;
        let n = self.channels.len();
        Ok(Self {
            channels: names.iter().map(|c| (*c).to_owned()).collect(),
            data: self.data.chunks_exact(n).flat_map(|p| at.iter().map(|c| p[*c])).collect(),
            metadata: self.metadata.clone(),
            ..*self
        })
    }

    /// R, G and B, or Y three times.
    ///
    /// # Errors
    /// [`ImageError::NoChannel`] when there is neither.
    pub fn to_rgb(&self) -> Result<Self, ImageError> {
        let names = if self.channel("R").is_none() && self.channel("Y").is_some() {
            ["Y"; 3]
        } else {
            ["R", "G", "B"]
        };
        let mut image = self.select(&names)?;
        image.channels = ["R", "G", "B"].map(str::to_owned).to_vec();
        Ok(image)
    }

    /// Adds the channels of an image of the same size, their names behind a prefix such as `variance.`.
    ///
    /// # Errors
    /// [`ImageError::Shape`] when the sizes differ.
    pub fn append(&mut self, prefix: &str, other: &Self) -> Result<(), ImageError> {
        if (self.width, self.height) != (other.width, other.height) {
            let (width, height, channels) = (self.width, self.height, other.channels.len());
            return Err(ImageError::Shape { width, height, channels, values: other.data.len() });
        }
        let (n, m) = (self.channels.len(), other.channels.len());
        let mut data = Vec::with_capacity(self.width * self.height * (n + m));
        for i in 0..self.width * self.height {
            data.extend_from_slice(&self.data[i * n..(i + 1) * n]);
            data.extend_from_slice(&other.data[i * m..(i + 1) * m]);
        }
        self.data = data;
        self.channels.extend(other.channels.iter().map(|c| format!("{prefix}{c}")));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> Image {
        let names = ["R", "G", "B"].map(str::to_owned).to_vec();
        Image::from_data(4, 3, names, (0..36).map(|i| i as f32).collect()).unwrap()
    }

    #[test]
    fn values_are_where_they_were_put() {
        let image = ramp();
        assert_eq!(image.pixel(1, 2), [27.0, 28.0, 29.0]);
        assert_eq!(image.get(3, 2, 2), Some(35.0));
        assert_eq!(image.get(4, 2, 2), None);
        assert_eq!(image.get(0, 0, 3), None);
        assert!(Image::from_data(4, 3, vec!["Y".into()], vec![0.0; 13]).is_err());
        assert!(Image::from_data(usize::MAX, 3, vec!["Y".into()], vec![]).is_err());
    }

    #[test]
    fn a_crop_knows_where_it_came_from() {
        let c = ramp().crop(Bounds2i { min: [1, 1], max: [3, 3] }).unwrap();
        let c = c.crop(Bounds2i { min: [1, 0], max: [2, 2] }).unwrap();
        assert_eq!((c.width(), c.height(), c.origin, c.full_size), (1, 2, [2, 1], [4, 3]));
        assert_eq!(c.data(), [18.0, 19.0, 20.0, 30.0, 31.0, 32.0]);
        for bad in [[-1, 0, 2, 2], [0, 0, 5, 1], [2, 2, 2, 3], [3, 0, 1, 1]] {
            let rect = Bounds2i { min: [bad[0], bad[1]], max: [bad[2], bad[3]] };
            assert!(ramp().crop(rect).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn channels_are_chosen_and_added_by_name() {
        let mut image = ramp();
        assert_eq!(image.select(&["B", "R"]).unwrap().pixel(0, 1), [14.0, 12.0]);
        assert!(image.select(&["Z"]).unwrap_err().to_string().contains("\"Z\""));
        image.append("variance.", &ramp()).unwrap();
        assert_eq!(image.channels()[4], "variance.G");
        assert_eq!(image.pixel(0, 1), [12.0, 13.0, 14.0, 12.0, 13.0, 14.0]);
        let grey = Image::new(2, 2, &["Y"]);
        assert_eq!(grey.to_rgb().unwrap().channels(), ["R", "G", "B"]);
        assert!(image.append("", &grey).is_err());
    }
}
