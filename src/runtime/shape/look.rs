//! What every cell looks at, for a pose of the platform.
//!
//! Rays are followed through the layers at every fourth cell; between, points and rays are the cubic through four by four of
//! these (Lagrange's), which is exact to some 1e-6 mm, and much faster. About the dome's outline every cell's own ray is followed.

use glam::{DVec3, Vec3A};

use super::cells::{Cells, View};
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;

/// Cells between two followed rays.
const STEP: usize = 4;

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
        view.nodes.clear();
        view.nodes.extend((0..columns * rows).map(|i| {
            let cell = i / columns * STEP * self.width + i % columns * STEP;
            self.follow(optics, cell)
        }));
        for i in 0..columns * rows {
            let (column, row) = (i % columns, i / columns);
            match around(optics, &view.nodes, (column, row), (columns, rows)) {
                Around::Nothing => {}
                Around::Smooth(nodes) => self.lay_between(optics, &nodes, (column, row), view),
                Around::Edge => {
                    for y in row * STEP..((row + 1) * STEP).min(self.height) {
                        for x in column * STEP..((column + 1) * STEP).min(self.width) {
                            let cell = y * self.width + x;
                            if let Some(seen) = self.follow(optics, cell) {
                                view.put(optics, cell, seen);
                            }
                        }
                    }
                }
            }
        }
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
        (column, row): (usize, usize),
        view: &mut View,
    ) {
        let mix = |of: [[Vec3A; 2]; 4], by: [f32; 4]| {
            [0, 1].map(|k| (of[0][k] * by[0] + of[1][k] * by[1]) + (of[2][k] * by[2] + of[3][k] * by[3]))
        };
        for (y, down) in WEIGHTS.into_iter().enumerate() {
            let line = [0, 1, 2, 3].map(|x| mix([0, 1, 2, 3].map(|y| nodes[y][x]), down));
            for (x, across) in WEIGHTS.into_iter().enumerate() {
                let cell = (row * STEP + y) * self.width + column * STEP + x;
                view.put(optics, cell, mix(line, across));
            }
        }
    }
}

impl View {
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
