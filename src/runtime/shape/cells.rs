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
    rays: Vec<DVec3>,
}

/// What the cells look at: the undeformed dome at a pose of the platform, sensor frame.
#[derive(Debug, Clone, Default)]
pub(super) struct View {
    pose: Option<Rigid>,
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

    /// Follows every cell's ray to the dome, unless the platform is where it was.
    /// Whether anything is new.
    pub fn look(&self, optics: &SensorOptics, pose: &Rigid, view: &mut View) -> bool {
        if view.pose.as_ref() == Some(pose) {
            return false;
        }
        view.pose = Some(*pose);
        let count = self.count();
        for list in [&mut view.surface_mm, &mut view.ray, &mut view.normal, &mut view.place] {
            list.resize(count, Vec3A::Z);
        }
        view.is_dome.resize(count, false);
        let dome = *optics.dome();
        let (center_mm, per_mm) = (dome.center_mm(), 1.0 / dome.radius_mm());
        for (i, ray) in self.rays.iter().enumerate() {
            let met = if ray.x.is_finite() { optics.follow_continued(*ray).ok() } else { None };
            view.is_dome[i] = met.is_some_and(|(point, _)| point.z > 0.0);
            let Some((point, inside)) = met.filter(|(point, _)| point.z > 0.0) else { continue };
            view.surface_mm[i] = point.as_vec3a();
            view.ray[i] = inside.as_vec3a();
            view.normal[i] = dome.normal(point).as_vec3a();
            view.place[i] = ((point - center_mm) * per_mm).as_vec3a();
        }
        view.spans.clear();
        view.spans.extend(view.is_dome.chunks(self.width).map(|row| {
            let first = row.iter().position(|is_dome| *is_dome).unwrap_or(0);
            first..row.iter().rposition(|is_dome| *is_dome).map_or(first, |last| last + 1)
        }));
        true
    }
}
