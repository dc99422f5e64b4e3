//! What every cell looks at, for a pose of the platform.
//!
//! Rays are followed through the layers at every fourth cell; between, points and rays are the cubic through four by four of
//! these (Lagrange's), which is exact to some 1e-6 mm, and much faster. About the dome's outline every cell's own ray is followed.

use glam::{DVec3, Vec3A};
use rayon::prelude::*;

use super::cells::{Cells, View};
use super::rows::share;
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;

/// Cells between two followed rays.
const STEP: usize = 4;

/// Rows of such that a thread takes at once, at least.
const MIN_NODE_ROWS: usize = 6;

/// Weights of four nodes in a row for the places of a step from the second on.
const WEIGHTS: [[f32; 4]; STEP] = [
    [0.0, 1.0, 0.0, 0.0],
    [-0.054_687_5, 0.820_312_5, 0.273_437_5, -0.039_062_5],
    [-0.062_5, 0.562_5, 0.562_5, -0.062_5],
    [-0.039_062_5, 0.273_437_5, 0.820_312_5, -0.054_687_5],
];

/// What the nodes about a block of cells see.
#[expect(clippy::large_enum_variant, reason = "one at a time, on the stack")]
enum Around {
    /// The dome alone: a smooth piece of it.
    Smooth([[[Vec3A; 2]; 4]; 4]),
    Edge,
    Nothing,
}

impl Cells {
    /// Finds what every cell looks at, unless the platform is where it was. Whether anything is new.
    pub fn look(&self, optics: &SensorOptics, pose: &Rigid, view: &mut View) -> bool {
        if view.pose.as_ref() == Some(pose) {
            return false;
        }
        view.pose = Some(*pose);
        let count = self.count();
        for list in [&mut view.surface_mm, &mut view.ray, &mut view.normal, &mut view.place] {
            list.resize(count, Vec3A::Z);
        }
        view.is_dome.clear();
        view.is_dome.resize(count, false);
        let (columns, rows) = (self.width.div_ceil(STEP), self.height.div_ceil(STEP));
        view.nodes.resize(columns * rows, None);
        let min_rows = share(MIN_NODE_ROWS);
        view.nodes.par_chunks_mut(columns).enumerate().with_min_len(min_rows).for_each(|(row, nodes)| {
            for (column, node) in nodes.iter_mut().enumerate() {
                *node = self.follow(optics, row * STEP * self.width + column * STEP);
            }
        });
        let (nodes, strips) = view.strips(STEP * self.width);
        strips.enumerate().with_min_len(min_rows).for_each(|(row, mut strip)| {
            for column in 0..columns {
                match around(optics, nodes, (column, row), (columns, rows)) {
                    Around::Nothing => {}
                    Around::Smooth(nodes) => self.lay_between(optics, &nodes, column, &mut strip),
                    Around::Edge => {
                        for y in 0..strip.is_dome.len() / self.width {
                            for x in column * STEP..((column + 1) * STEP).min(self.width) {
                                let own = y * self.width + x;
                                if let Some(seen) = self.follow(optics, row * STEP * self.width + own) {
                                    strip.put(optics, own, seen);
                                }
                            }
                        }
                    }
                }
            }
        });
        view.spans.clear();
        view.spans.extend(view.is_dome.chunks(self.width).map(|row| {
            let first = row.iter().position(|is_dome| *is_dome).unwrap_or(0);
            first..row.iter().rposition(|is_dome| *is_dome).map_or(first, |last| last + 1)
        }));
        true
    }

    /// Point on the dome and direction in it of a cell's ray.
    fn follow(&self, optics: &SensorOptics, cell: usize) -> Option<[Vec3A; 2]> {
        let ray: &DVec3 = self.rays.get(cell).filter(|ray| ray.x.is_finite())?;
        let (point, inside) = optics.follow_continued(*ray).ok()?;
        (point.z > 0.0).then(|| [point.as_vec3a(), inside.as_vec3a()])
    }

    fn lay_between(
        &self,
        optics: &SensorOptics,
        nodes: &[[[Vec3A; 2]; 4]; 4],
        column: usize,
        strip: &mut Strip<'_>,
    ) {
        let mix = |of: [[Vec3A; 2]; 4], by: [f32; 4]| {
            [0, 1].map(|k| (of[0][k] * by[0] + of[1][k] * by[1]) + (of[2][k] * by[2] + of[3][k] * by[3]))
        };
        for (y, down) in WEIGHTS.into_iter().enumerate() {
            let line = [0, 1, 2, 3].map(|x| mix([0, 1, 2, 3].map(|y| nodes[y][x]), down));
            for (x, across) in WEIGHTS.into_iter().enumerate() {
                strip.put(optics, y * self.width + column * STEP + x, mix(line, across));
            }
        }
    }
}

/// What is found in some rows of cells.
struct Strip<'a> {
    surface_mm: &'a mut [Vec3A],
    ray: &'a mut [Vec3A],
    normal: &'a mut [Vec3A],
    place: &'a mut [Vec3A],
    is_dome: &'a mut [bool],
}

impl View {
    /// The nodes, and strips of so many cells.
    fn strips(
        &mut self,
        cells: usize,
    ) -> (&[Option<[Vec3A; 2]>], impl IndexedParallelIterator<Item = Strip<'_>>) {
        let seen = self.surface_mm.par_chunks_mut(cells).zip(self.ray.par_chunks_mut(cells));
        let faces = self.normal.par_chunks_mut(cells).zip(self.place.par_chunks_mut(cells));
        let all = seen.zip(faces).zip(self.is_dome.par_chunks_mut(cells));
        let strip = |(((surface_mm, ray), (normal, place)), is_dome)| Strip {
            surface_mm,
            ray,
            normal,
            place,
            is_dome,
        };
        (&self.nodes, all.map(strip))
    }
}

impl Strip<'_> {
    fn put(&mut self, optics: &SensorOptics, cell: usize, [point, inside]: [Vec3A; 2]) {
        let dome = optics.dome();
        let place = (point - dome.center_mm().as_vec3a()) / dome.radius_mm() as f32;
        let has_wall = dome.center_z_mm() > 0.0;
        self.is_dome[cell] = true;
        self.surface_mm[cell] = point;
        self.ray[cell] = inside;
        self.normal[cell] =
            if has_wall { dome.normal(point.as_dvec3()).as_vec3a() } else { place.normalize_or(Vec3A::Z) };
        self.place[cell] = place;
    }
}

fn around(
    optics: &SensorOptics,
    all: &[Option<[Vec3A; 2]>],
    (column, row): (usize, usize),
    (columns, rows): (usize, usize),
) -> Around {
    let is_within =
        (1..columns.saturating_sub(2)).contains(&column) && (1..rows.saturating_sub(2)).contains(&row);
    if !is_within {
        return Around::Edge;
    }
    let mut nodes = [[[Vec3A::ZERO; 2]; 4]; 4];
    let (mut count, mut low, mut high) = (0, f32::INFINITY, f32::NEG_INFINITY);
    for (y, line) in nodes.iter_mut().enumerate() {
        for (x, node) in line.iter_mut().enumerate() {
            if let Some(Some(seen)) = all.get((row + y - 1) * columns + column + x - 1) {
                *node = *seen;
                count += 1;
                (low, high) = (low.min(seen[0].z), high.max(seen[0].z));
            }
        }
    }
    // Where a sphere stands on a cylinder the face is bent, but not smoothly.
    let foot_mm = optics.dome().center_z_mm() as f32;
    let is_bent = foot_mm > 0.0 && low < foot_mm && high > foot_mm;
    match count {
        0 => Around::Nothing,
        16 if !is_bent => Around::Smooth(nodes),
        _ => Around::Edge,
    }
}
