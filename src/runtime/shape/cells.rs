//! The grid of cells that the shape is solved on, and what each looks at.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec3A};

use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;

/// Pixels along each side of a cell: half of the picture's resolution halves the noise, and colour comes no finer from a
/// camera whose chroma is halved.
pub(super) const CELL_PX: usize = 2;

/// Cells of a picture.
#[derive(Debug, Clone)]
pub(super) struct Cells {
    pub width: usize,
    pub height: usize,
    /// Unit direction in the camera's frame that each looks along; NaN beyond the lens's field.
    pub(super) rays: Vec<DVec3>,
}

/// What the cells look at: the undeformed dome at a pose of the platform, sensor frame.
#[derive(Debug, Clone, Default)]
pub(super) struct View {
    pub(super) pose: Option<Rigid>,
    /// Every fourth cell's point on the dome and ray, where it has one.
    pub(super) nodes: Vec<Option<[Vec3A; 2]>>,
    /// The dome, mm.
    pub surface_mm: Vec<Vec3A>,
    /// Unit direction in the silicone, away from the camera.
    pub ray: Vec<Vec3A>,
    /// Outward unit normal of the dome.
    pub normal: Vec<Vec3A>,
    /// The place on the unit dome that the light is looked up at.
    pub place: Vec<Vec3A>,
    /// Whether the cell looks at the dome.
    pub is_dome: Vec<bool>,
    /// The columns of each row between which all such cells lie.
    pub spans: Vec<Range<usize>>,
}

impl Cells {
    pub fn new(optics: &SensorOptics) -> Self {
        let spec = optics.lens().spec();
        let (width, height) = (spec.width as usize / CELL_PX, spec.height as usize / CELL_PX);
        let lens = optics.lens();
        let ray = |i: usize| {
            let at = Self::center_of(i % width, i / width);
            lens.unproject(at).unwrap_or(DVec3::NAN)
        };
        Self { width, height, rays: (0..width * height).map(ray).collect() }
    }

    /// The pixel in the middle of a cell.
    pub fn center_of(column: usize, row: usize) -> DVec2 {
        let at = |i: usize| (i * CELL_PX) as f64 + 0.5 * (CELL_PX as f64 - 1.0);
        DVec2::new(at(column), at(row))
    }

    /// Cell coordinates of a pixel.
    pub fn of_pixel(pixel: DVec2) -> DVec2 {
        (pixel - 0.5 * (CELL_PX as f64 - 1.0)) / CELL_PX as f64
    }

    /// Cosine of the field angle that a cell looks along; 1 beyond the lens's field.
    #[inline]
    pub fn cosine(&self, cell: usize) -> f32 {
        let cosine = self.rays[cell].z as f32;
        if cosine > 0.0 { cosine } else { 1.0 }
    }

    pub fn count(&self) -> usize {
        self.width * self.height
    }
}
