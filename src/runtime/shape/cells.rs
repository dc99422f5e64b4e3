//! The grid of cells that the shape is solved on, and what each looks at.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec3A};

use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;

/// Cells of a picture.
#[derive(Debug, Clone)]
pub(super) struct Cells {
    /// Pixels along each side of a cell.
    pub px: usize,
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
    pub fn new(optics: &SensorOptics, px: usize) -> Self {
        let lens = optics.lens();
        let (width, height) = (lens.spec().width as usize / px, lens.spec().height as usize / px);
        let mut cells = Self { px, width, height, rays: Vec::new() };
        let ray = |i: usize| lens.unproject(cells.center_of(i % width, i / width)).unwrap_or(DVec3::NAN);
        cells.rays = (0..width * height).map(ray).collect();
        cells
    }

    /// The pixel in the middle of a cell.
    pub fn center_of(&self, column: usize, row: usize) -> DVec2 {
        let at = |i: usize| (i * self.px) as f64 + 0.5 * (self.px as f64 - 1.0);
        DVec2::new(at(column), at(row))
    }

    /// Cell coordinates of a pixel.
    pub fn of_pixel(&self, pixel: DVec2) -> DVec2 {
        (pixel - 0.5 * (self.px as f64 - 1.0)) / self.px as f64
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
