//! The film in device memory.

use crate::abi;
use crate::vk::{Buffer, Device, Error, Location, Recording, Usage};
use scene::LightStyle;
use scene::render::{Clamped, Counters, ESCAPES_KEPT, Escape, Film, Settings, StyleLayer};
use std::sync::Arc;

/// Running sums per pixel and counters; see `shaders/lib/film.glsl`.
pub struct GpuFilm {
    width: u32,
    height: u32,
    planes: u32,
    /// Whether samples are clamped; what they lose is in the plane after the others.
    clamps: bool,
    /// Which light styles it tells apart.
    pub(crate) styles: Vec<LightStyle>,
    /// Planes of `width * height` vec4, one after the other.
    pub(crate) sums: Arc<Buffer>,
    counters: Arc<Buffer>,
    escapes: Arc<Buffer>,
    /// Where the two are.
    tallies: Arc<Buffer>,
}

const _: () = assert!(abi::ESCAPES_KEPT as usize == ESCAPES_KEPT);

const VEC4: u64 = size_of::<abi::vec4>() as u64;

impl GpuFilm {
    /// Makes an empty film for `settings` that tells `styles` apart.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn new(
        device: &Arc<Device>,
        settings: &Settings,
        styles: &[LightStyle],
    ) -> Result<Self, Error> {
        let planes = if settings.aovs {
            abi::PLANES_ALL
        } else {
            abi::PLANES_BASIC
        };
        let pixels = u64::from(settings.width) * u64::from(settings.height);
        let clamps = Self::clamp_of(settings, styles.len() > 1).is_some();
        // Never both.
        let more = styles.len().saturating_sub(1) as u64 + u64::from(clamps);
        let make =
            |name, size| Buffer::new(device, name, size, Usage::STORAGE_BUFFER, Location::Device);
        let counters = make("counters", size_of::<abi::Counters>() as u64)?;
        let escapes = make("escapes", (ESCAPES_KEPT * size_of::<abi::Escape>()) as u64)?;
        let tallies = abi::Tallies {
            counters: counters.address(),
            escapes: escapes.address(),
        };
        let film = Self {
            width: settings.width,
            height: settings.height,
            planes,
            clamps,
            styles: styles.to_vec(),
            sums: make("film", (u64::from(planes) + more) * pixels * VEC4)?,
            counters,
            escapes,
            tallies: Buffer::with_data(
                device,
                "tallies",
                Usage::STORAGE_BUFFER,
                bytemuck::bytes_of(&tallies),
            )?,
        };
        film.clear()?;
        Ok(film)
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Whether it has all its layers.
    pub fn has_layers(&self) -> bool {
        self.planes == abi::PLANES_ALL
    }

    /// What samples are clamped to: nothing where light is summed by styles.
    pub fn clamp_of(settings: &Settings, by_styles: bool) -> Option<f32> {
        settings.clamp.filter(|_| !by_styles)
    }

    /// Where shaders find what they count; `recording` keeps it.
    pub fn tallies(&self, recording: &mut Recording) -> u64 {
        for buffer in [&self.counters, &self.escapes, &self.tallies] {
            recording.keep(buffer.clone());
        }
        self.tallies.address()
    }

    /// Empties the film.
    ///
    /// # Errors
    /// When a call fails.
    pub fn clear(&self) -> Result<(), Error> {
        let mut recording = Recording::begin(self.sums.device())?;
        self.record_clear(&mut recording);
        recording.submit_and_wait()?;
        Ok(())
    }

    /// Records that the film is empty from here on.
    pub fn record_clear(&self, recording: &mut Recording) {
        recording.clear(&self.sums);
        recording.clear(&self.counters);
    }

    /// Rays that were traced for the film so far.
    ///
    /// # Errors
    /// When a call fails or there is no memory.
    pub fn rays(&self) -> Result<u64, Error> {
        let device = self.sums.device();
        let size = self.counters.size();
        let host = Buffer::new(device, "counters", size, Usage::empty(), Location::ReadBack)?;
        let mut recording = Recording::begin(device)?;
        recording.copy(&self.counters, &host, (0, 0), size);
        recording.submit_and_wait()?;
        let counted: abi::Counters =
            *bytemuck::from_bytes(&host.read()?[..size_of::<abi::Counters>()]);
        Ok(wide(counted.rays))
    }

    /// Reads the film back and turns sums into means.
    ///
    /// # Errors
    /// When a call fails or there is no memory.
    pub fn read_back(&self) -> Result<Film, Error> {
        let device = self.sums.device();
        let copy = |size| {
            Buffer::new(
                device,
                "read-back",
                size,
                Usage::empty(),
                Location::ReadBack,
            )
        };
        let (sums, counters) = (copy(self.sums.size())?, copy(self.counters.size())?);
        let escapes = copy(self.escapes.size())?;
        let mut recording = Recording::begin(device)?;
        recording.copy(&self.sums, &sums, (0, 0), self.sums.size());
        recording.copy(&self.counters, &counters, (0, 0), self.counters.size());
        recording.copy(&self.escapes, &escapes, (0, 0), self.escapes.size());
        recording.submit_and_wait()?;

        let pixels = self.width as usize * self.height as usize;
        let styled = self.styles.len().saturating_sub(1) as u32;
        let more = styled + u32::from(self.clamps);
        let used = pixels * (self.planes + more) as usize * VEC4 as usize;
        let words: &[abi::vec4] = bytemuck::cast_slice(&sums.read()?[..used]);
        let plane = |index: u32| &words[index as usize * pixels..][..pixels];
        let counts: Vec<u32> = (plane(abi::PLANE_BEAUTY).iter())
            .map(|p| p[3] as u32)
            .collect();
        let taken: u64 = counts.iter().map(|&n| u64::from(n)).sum();
        let mean = |(p, &n): (&abi::vec4, &u32)| {
            [0, 1, 2].map(|c| (f64::from(p[c]) / f64::from(n.max(1))) as f32)
        };
        let layer = |index: u32| plane(index).iter().zip(&counts).map(mean).collect();
        let mut film = Film {
            width: self.width,
            height: self.height,
            samples: (taken as f64 / pixels as f64).round() as u32,
            beauty: layer(abi::PLANE_BEAUTY),
            // Sample variance of one sample is not known; that of the mean needs two.
            variance: (plane(abi::PLANE_DEVIATION).iter().zip(&counts))
                .map(|(d, &n)| {
                    let n = f64::from(n.max(1));
                    [0, 1, 2].map(|c| (f64::from(d[c]) / (n * (n - 1.0).max(1.0))) as f32)
                })
                .collect(),
            ..Film::default()
        };
        let but_first = (self.planes..self.planes + styled).map(layer);
        film.styles = StyleLayer::all(&self.styles, &film.beauty, but_first);
        if self.clamps {
            let mut clamped = Clamped::default();
            for (p, &n) in plane(self.planes).iter().zip(&counts) {
                for (sum, lost) in clamped.lost.iter_mut().zip(p) {
                    *sum += f64::from(*lost) / (f64::from(n.max(1)) * pixels as f64);
                }
                clamped.samples += p[3] as u64;
            }
            film.clamped = Some(clamped);
        }
        if self.has_layers() {
            film.emission = layer(abi::PLANE_EMISSION);
            film.direct = layer(abi::PLANE_DIRECT);
            film.indirect = layer(abi::PLANE_INDIRECT);
            film.albedo = layer(abi::PLANE_ALBEDO);
            film.normal = layer(abi::PLANE_NORMAL);
            film.position = layer(abi::PLANE_POSITION);
            film.depth = (plane(abi::PLANE_COMPENSATION).iter().zip(&counts))
                .map(|(p, &n)| (f64::from(p[3]) / f64::from(n.max(1))) as f32)
                .collect();
            let down = plane(abi::PLANE_DIRECT).iter();
            film.motion = (plane(abi::PLANE_EMISSION).iter().zip(down).zip(&counts))
                .map(|((right, down), &n)| {
                    [right[3], down[3]].map(|sum| (f64::from(sum) / f64::from(n.max(1))) as f32)
                })
                .collect();
            film.id = plane(abi::PLANE_DEVIATION)
                .iter()
                .map(|p| p[3].to_bits())
                .collect();
        }
        let used = size_of::<abi::Counters>();
        let counted: abi::Counters = *bytemuck::from_bytes(&counters.read()?[..used]);
        film.counters = Counters {
            paths: taken,
            rays: wide(counted.rays),
            nonfinite: wide(counted.nonfinite),
            escaped: wide(counted.escaped),
        };
        let kept: &[abi::Escape] =
            bytemuck::cast_slice(&escapes.read()?[..ESCAPES_KEPT * size_of::<abi::Escape>()]);
        let count = film.counters.escaped.min(ESCAPES_KEPT as u64) as usize;
        film.escapes = (kept[..count].iter())
            .map(|e| Escape {
                pixel: e.pixel,
                sample: e.sample_index,
                origin: e.origin,
                direction: e.direction,
            })
            .collect();
        film.escapes.sort_by_key(|e| (e.pixel, e.sample));
        if counts.iter().any(|&n| n != counts[0]) {
            film.sample_counts = counts;
        }
        Ok(film)
    }
}

/// A number of two words.
fn wide([low, high]: abi::uvec2) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}
