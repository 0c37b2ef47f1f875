//! Where pictures are shown: a window, or an image of the same frame loop without one.

use crate::passes::denoise::Denoise;
use crate::passes::overlay::{Mesh, Overlay, PICTURE};
use crate::passes::tonemap::{ToneCurve, Tonemap};
use crate::renderer::{Gpu, PathTracer};
use crate::vk::{
    Buffer, Device, Error, FRAMES_IN_FLIGHT, Filter, Format, Image, Location, Pace, Presented,
    Recording, Submission, Surface, Swapchain, Target, Timing, Usage, Window,
};
use std::collections::VecDeque;
use std::sync::Arc;

/// Size, and red, green, blue and alpha of each pixel, rows from the top.
pub type Pixels = ([u32; 2], Vec<[u8; 4]>);

/// How a film is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// From radiance to the display.
    pub curve: ToneCurve,
    /// Exposure in stops.
    pub ev: f32,
    /// Without its noise, where the film has its layers (`Settings::aovs`). A picture of few samples gets from the one
    /// before what that knew of the same places.
    pub denoise: bool,
}

/// What became of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// It is on its way.
    Yes,
    /// There was nothing to show it on: the window has no area, is hidden, or is changing its size.
    /// Worth another try with the next frame.
    No,
}

/// Draws the traced picture and triangles over it, again and again, at most two frames ahead of the
/// device.
pub struct Screen {
    place: Place,
    overlay: Overlay,
    tonemap: Tonemap,
    /// While films are shown without their noise.
    denoise: Option<Denoise>,
    /// The traced picture: its display codes as a buffer and as a texture.
    picture: Option<(Arc<Buffer>, Arc<Image>)>,
    /// New textures with their texels, which the next frame uploads.
    uploads: Vec<(Arc<Buffer>, Arc<Image>)>,
    under_way: VecDeque<Submission>,
    timings: Vec<Timing>,
    device: Arc<Device>,
}

enum Place {
    Window {
        surface: Arc<Surface>,
        /// `None` while the window has no area, or its pictures no longer fit it.
        chain: Option<Swapchain>,
        size: [u32; 2],
        pace: Pace,
    },
    OffScreen(Arc<Image>),
}

impl Screen {
    /// A window's screen. `size` is the window's, in pixels.
    ///
    /// # Errors
    /// When the device can't show on the window, or a call fails.
    pub fn of_window<W: Window>(gpu: &Gpu, window: Arc<W>, size: [u32; 2]) -> Result<Self, Error> {
        let device = Arc::clone(gpu.device());
        let surface = Surface::new(device.instance(), window)?;
        let pace = Pace::default();
        let chain = Swapchain::new(&device, &surface, size, pace, None)?;
        let format = chain.as_ref().map_or(PLAIN, Swapchain::format);
        let place = Place::Window {
            surface,
            chain,
            size,
            pace,
        };
        Self::new(device, place, format)
    }

    /// A screen that nobody sees, to be read.
    ///
    /// # Errors
    /// When there is no memory, or a call fails.
    pub fn off_screen(gpu: &Gpu, size: [u32; 2]) -> Result<Self, Error> {
        let device = Arc::clone(gpu.device());
        let image = Image::to_draw_on(&device, size[0].max(1), size[1].max(1))?;
        Self::new(device, Place::OffScreen(image), PLAIN)
    }

    fn new(device: Arc<Device>, place: Place, format: Format) -> Result<Self, Error> {
        Ok(Self {
            place,
            overlay: Overlay::new(&device, format)?,
            tonemap: Tonemap::new(&device)?,
            denoise: None,
            picture: None,
            uploads: Vec::new(),
            under_way: VecDeque::new(),
            timings: Vec::new(),
            device,
        })
    }

    /// The paces that the place knows; none off-screen.
    #[must_use]
    pub fn paces(&self) -> &[Pace] {
        match &self.place {
            Place::Window { chain, .. } => chain.as_ref().map_or(&[], Swapchain::paces),
            Place::OffScreen(_) => &[],
        }
    }

    /// Shows at another pace from now on.
    pub fn set_pace(&mut self, wanted: Pace) {
        if let Place::Window { chain, pace, .. } = &mut self.place
            && *pace != wanted
        {
            *pace = wanted;
            *chain = None;
        }
    }

    /// Takes the size that its window has now, in pixels. Nothing is shown while that is 0.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn resize(&mut self, to: [u32; 2]) -> Result<(), Error> {
        match &mut self.place {
            Place::Window { chain, size, .. } => {
                if *size != to {
                    *size = to;
                    *chain = None;
                }
            }
            Place::OffScreen(image) => {
                *image = Image::to_draw_on(&self.device, to[0].max(1), to[1].max(1))?;
            }
        }
        Ok(())
    }

    /// Takes another window's place, or the same window's anew after its surface was lost.
    ///
    /// # Errors
    /// As [`Self::of_window`].
    pub fn move_to<W: Window>(&mut self, window: Arc<W>, to: [u32; 2]) -> Result<(), Error> {
        self.settle()?;
        let keep = match &mut self.place {
            Place::Window { chain, pace, .. } => {
                *chain = None;
                *pace
            }
            Place::OffScreen(_) => Pace::default(),
        };
        let surface = Surface::new(self.device.instance(), window)?;
        self.place = Place::Window {
            surface,
            chain: None,
            size: to,
            pace: keep,
        };
        Ok(())
    }

    /// Gives a texture of `size` texels a number: display codes, premultiplied by alpha.
    ///
    /// # Errors
    /// When it is too large for the device, or there is no memory.
    ///
    /// # Panics
    /// When there are not as many texels as `size` says.
    pub fn set_texture(
        &mut self,
        number: u64,
        size: [u32; 2],
        texels: &[[u8; 4]],
        filter: Filter,
    ) -> Result<(), Error> {
        let count = size[0] as usize * size[1] as usize;
        assert_eq!(texels.len(), count, "texels as many as the size says");
        let bytes = bytemuck::cast_slice(texels);
        let buffer = Buffer::with_data(&self.device, "texels", Usage::empty(), bytes)?;
        let image = Image::new(&self.device, "overlay texture", size[0], size[1])?;
        self.overlay.set(number, &image, filter)?;
        self.uploads.push((buffer, image));
        Ok(())
    }

    /// Forgets a texture.
    pub fn forget_texture(&mut self, number: u64) {
        self.overlay.forget(number);
    }

    /// Shows a frame: `meshes` on black, in order, `scale` pixels to a point. With `film` the texture
    /// [`PICTURE`] is the path tracer's film from now on; without it that texture stays as it was.
    ///
    /// # Errors
    /// When the device fails, [`Error::SurfaceLost`] among that, or there is no memory.
    pub fn draw(
        &mut self,
        film: Option<(&PathTracer, Look)>,
        filter: Filter,
        meshes: &[Mesh<'_>],
        scale: f32,
    ) -> Result<Shown, Error> {
        while self.under_way.len() >= FRAMES_IN_FLIGHT {
            self.finish_one()?;
        }
        if let Place::Window {
            surface,
            chain,
            size,
            pace,
        } = &mut self.place
        {
            if chain.is_none() {
                *chain = Swapchain::new(&self.device, surface, *size, *pace, None)?;
            }
            let Some(chain) = chain else {
                return Ok(Shown::No);
            };
            self.overlay.follow(&self.device, chain.format())?;
        }
        let picture = match film {
            Some((tracer, _)) => Some(self.picture_of(tracer, filter)?),
            None => None,
        };
        if let Some((tracer, look)) = film {
            let wanted = look.denoise && tracer.gpu_film().has_layers();
            self.denoise = match self.denoise.take().filter(|_| wanted) {
                None if wanted => Some(Denoise::new(&self.device)?),
                as_it_was => as_it_was,
            };
        }
        let denoise = &mut self.denoise;
        let (device, overlay, tonemap) = (&self.device, &self.overlay, &self.tonemap);
        let uploads = &mut self.uploads;
        let mut record = |target: &Target| {
            let mut recording = Recording::begin(device)?;
            for (texels, image) in uploads.drain(..) {
                recording.upload_image(&texels, 0, &image);
            }
            if let (Some((tracer, look)), Some((codes, image))) = (film, &picture) {
                let film = tracer.gpu_film();
                let sums = match denoise {
                    Some(denoise) => denoise.record(&mut recording, &tracer.sight())?,
                    None => film.sums.clone(),
                };
                let how = (look.curve, look.ev);
                tonemap.record(&mut recording, (&sums, film.size()), codes, how)?;
                recording.upload_image(codes, 0, image);
            }
            overlay.record(&mut recording, target, meshes, scale)?;
            Ok(recording)
        };
        let submission = match &mut self.place {
            Place::OffScreen(image) => record(&Target::image(image))?.submit()?,
            Place::Window { chain: slot, .. } => {
                let Some(chain) = slot else {
                    return Ok(Shown::No);
                };
                match chain.show(&mut record)? {
                    Presented::Yes(submission) => submission,
                    Presented::Stale(submission) => {
                        *slot = None;
                        submission
                    }
                    Presented::No { stale } => {
                        if stale {
                            *slot = None;
                        }
                        return Ok(Shown::No);
                    }
                }
            }
        };
        self.under_way.push_back(submission);
        Ok(Shown::Yes)
    }

    /// Buffer and texture for a path tracer's film.
    fn picture_of(
        &mut self,
        tracer: &PathTracer,
        filter: Filter,
    ) -> Result<(Arc<Buffer>, Arc<Image>), Error> {
        let [width, height] = tracer.gpu_film().size();
        let bytes = 4 * u64::from(width) * u64::from(height);
        let fits = |(_, image): &(Arc<Buffer>, Arc<Image>)| image.size() == [width, height];
        let both = match self.picture.take().filter(fits) {
            Some(both) => both,
            None => {
                let (usage, location) = (Usage::STORAGE_BUFFER, Location::Device);
                let codes = Buffer::new(&self.device, "display", bytes, usage, location)?;
                (codes, Image::new(&self.device, "display", width, height)?)
            }
        };
        if !self.overlay.has(PICTURE, &both.1, filter) {
            self.overlay.set(PICTURE, &both.1, filter)?;
        }
        self.picture = Some(both.clone());
        Ok(both)
    }

    fn finish_one(&mut self) -> Result<(), Error> {
        if let Some(first) = self.under_way.pop_front() {
            self.timings = first.wait()?;
        }
        Ok(())
    }

    /// GPU times of the frame that was done last: `denoise`, `tone map` and `overlay`.
    #[must_use]
    pub fn timings(&self) -> &[Timing] {
        &self.timings
    }

    /// Waits until all frames are done.
    ///
    /// # Errors
    /// When the device fails.
    pub fn settle(&mut self) -> Result<(), Error> {
        while !self.under_way.is_empty() {
            self.finish_one()?;
        }
        Ok(())
    }

    /// What was drawn last off-screen: size, and red, green, blue and alpha of each pixel, rows from the
    /// top. `None` of windows, and before the first frame.
    ///
    /// # Errors
    /// When the device fails or there is no memory.
    pub fn read(&mut self) -> Result<Option<Pixels>, Error> {
        let drawn = !self.under_way.is_empty() || !self.timings.is_empty();
        self.settle()?;
        let Place::OffScreen(image) = &self.place else {
            return Ok(None);
        };
        if !drawn {
            return Ok(None);
        }
        let size = image.size();
        let bytes = 4 * u64::from(size[0]) * u64::from(size[1]);
        let (usage, location) = (Usage::empty(), Location::ReadBack);
        let host = Buffer::new(&self.device, "screen", bytes, usage, location)?;
        let mut recording = Recording::begin(&self.device)?;
        recording.download_image(image, &host);
        recording.submit_and_wait()?;
        let texels = bytemuck::cast_slice(&host.read()?[..bytes as usize]).to_vec();
        Ok(Some((size, texels)))
    }
}

/// The format off-screen, and until a window says another.
const PLAIN: Format = Format::R8G8B8A8_UNORM;
