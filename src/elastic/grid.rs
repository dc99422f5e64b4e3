//! Where the dome can be touched: rings of nodes about its axis.

use std::f64::consts::{PI, TAU};

use domecast_optics::DomeShape;
use glam::{DMat3, DVec2, DVec3};

use crate::element::{GAUSS, quadratic};

/// The contact nodes: ring j lies j steps along the meridian, and carries evenly spaced nodes.
///
/// A node's force is spread as a hat over its two neighbours' distance, along the ring and across it, and the gap
/// is measured with the same hat: so the compliance is symmetric, and finite on any mesh.
#[derive(Debug, Clone)]
pub struct Grid {
    /// The dome's face.
    pub dome: DomeShape,
    /// Elements along the meridian; ring `elements` would be the bonded rim, and is left out.
    pub elements: usize,
    /// Azimuths that the tables know: every ring's count divides it.
    pub azimuths: usize,
    /// Nodes of each ring, and the number of its first.
    pub counts: Vec<usize>,
    /// Number of each ring's first node.
    pub first: Vec<usize>,
    /// Surface that a node of each ring stands for, mm2.
    pub areas_mm2: Vec<f64>,
    /// How far what else bears on the dome moves each node, sensor frame, mm; empty where nothing does.
    pub offsets_mm: Vec<DVec3>,
}

/// A node by ring and azimuth step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridNode {
    /// Its ring, from the pole.
    pub ring: usize,
    /// Azimuth in steps of the tables.
    pub step: usize,
}

impl Grid {
    /// For a dome with this many elements along the meridian.
    pub fn new(dome: DomeShape, elements: usize) -> Self {
        let (end_rad, radius_mm) = (dome.meridian_end_rad(), dome.radius_mm());
        // Nodes as far apart along the widest ring as the rings are.
        let around = |of_radius: f64| (TAU / end_rad * elements as f64 * of_radius).ceil() as usize;
        let mut azimuths = 12;
        while azimuths < around(dome.rim_radius_mm() / radius_mm) {
            azimuths *= 2;
        }
        let mut grid = Self {
            dome,
            elements,
            azimuths,
            counts: Vec::new(),
            first: Vec::new(),
            areas_mm2: Vec::new(),
            offsets_mm: Vec::new(),
        };
        let mut next = 0;
        for ring in 0..elements {
            let wanted = around(dome.ring_radius_mm(grid.meridian_rad(ring)) / radius_mm);
            // The least divisor of the table's count that is fine enough; six at least, to turn alike.
            let count = if ring == 0 {
                1
            } else {
                (6..=azimuths).find(|n| azimuths % n == 0 && *n >= wanted).unwrap_or(azimuths)
            };
            let band: f64 =
                grid.quadrature(ring).iter().map(|(at, w, hat)| w * hat * dome.ring_radius_mm(*at)).sum();
            grid.areas_mm2.push(band * radius_mm * TAU / count as f64);
            grid.counts.push(count);
            grid.first.push(next);
            next += count;
        }
        grid
    }

    /// All nodes.
    pub fn len(&self) -> usize {
        self.first.last().map_or(0, |first| first + self.counts[self.counts.len() - 1])
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The node of a number.
    pub fn node(&self, number: usize) -> GridNode {
        let ring = self.first.partition_point(|first| *first <= number) - 1;
        GridNode { ring, step: (number - self.first[ring]) * (self.azimuths / self.counts[ring]) }
    }

    /// Where a ring lies: length of the meridian from the pole over the sphere's radius.
    pub fn meridian_rad(&self, ring: usize) -> f64 {
        self.dome.meridian_end_rad() * ring as f64 / self.elements as f64
    }

    /// Distance of the rings, mm.
    pub fn spacing_mm(&self) -> f64 {
        self.dome.radius_mm() * self.dome.meridian_end_rad() / self.elements as f64
    }

    /// The element of the meridian under a point of the dome, and the place in it from -1 to 1.
    pub fn element_at(&self, at_mm: DVec3) -> (usize, f64) {
        let s = self.dome.meridian_rad(at_mm) / self.dome.meridian_end_rad() * self.elements as f64;
        let element = (s as usize).min(self.elements - 1);
        (element, 2.0 * (s - element as f64) - 1.0)
    }

    /// Its azimuth, rad.
    pub fn azimuth(&self, node: GridNode) -> f64 {
        TAU * node.step as f64 / self.azimuths as f64
    }

    /// The node's frame, columns e_r, e_z, e_phi in the sensor frame.
    pub fn frame(&self, node: GridNode) -> DMat3 {
        let (sine, cosine) = self.azimuth(node).sin_cos();
        DMat3::from_cols(DVec3::new(cosine, sine, 0.0), DVec3::Z, DVec3::new(-sine, cosine, 0.0))
    }

    /// A node by its number's parts.
    pub fn number(&self, node: GridNode) -> usize {
        self.first[node.ring] + node.step / (self.azimuths / self.counts[node.ring])
    }

    /// Where a node lies before the object that is looked at touches it, mm.
    pub fn place(&self, node: GridNode) -> DVec3 {
        self.dome.point_mm(self.meridian_rad(node.ring), self.azimuth(node)) + self.offset(self.number(node))
    }

    /// How far what else bears on the dome moves a node, mm.
    pub fn offset(&self, number: usize) -> DVec3 {
        self.offsets_mm.get(number).copied().unwrap_or(DVec3::ZERO)
    }

    /// Standard deviations of a node's hat along the meridian and along the ring, as vectors, mm.
    pub fn spread(&self, node: GridNode) -> [DVec3; 2] {
        let meridian_rad = self.meridian_rad(node.ring);
        let normal = self.dome.normal(self.dome.point_mm(meridian_rad, self.azimuth(node)));
        let (s, c) = self.azimuth(node).sin_cos();
        let east = DVec3::new(-s, c, 0.0);
        let (south, spacing) = (east.cross(normal), self.spacing_mm());
        if node.ring == 0 {
            // A cone over a disc: 3/20 of its radius squared.
            return [south * spacing * 0.15_f64.sqrt(), east * spacing * 0.15_f64.sqrt()];
        }
        let along = self.dome.ring_radius_mm(meridian_rad) * TAU / self.counts[node.ring] as f64;
        [south * spacing / 6.0_f64.sqrt(), east * along / 6.0_f64.sqrt()]
    }

    /// The nodes whose hats a point of the undeformed dome lies under, with the hats' values there.
    pub fn hats_at(&self, at_mm: DVec3) -> [(usize, f64); 4] {
        let along = self.dome.meridian_rad(at_mm) / self.dome.meridian_end_rad() * self.elements as f64;
        let azimuth = if at_mm.truncate() == DVec2::ZERO { 0.0 } else { at_mm.y.atan2(at_mm.x) };
        let (inner, over) = (along.floor() as usize, along - along.floor());
        let mut hats = [(0, 0.0); 4];
        for (k, (ring, across)) in [(inner, 1.0 - over), (inner + 1, over)].into_iter().enumerate() {
            let (Some(&count), Some(&first)) = (self.counts.get(ring), self.first.get(ring)) else {
                continue;
            };
            let around = azimuth.rem_euclid(TAU) / TAU * count as f64;
            let (step, part) = (around.floor() as usize, around - around.floor());
            hats[2 * k] = (first + step % count, across * (1.0 - part));
            hats[2 * k + 1] = (first + (step + 1) % count, across * part);
        }
        hats
    }

    /// Points (as [`Grid::meridian_rad`]), weights and the hat's value over the ring's elements.
    fn quadrature(&self, ring: usize) -> Vec<(f64, f64, f64)> {
        let h = self.dome.meridian_end_rad() / self.elements as f64;
        let mut points = Vec::with_capacity(6);
        for element in ring.saturating_sub(1)..=ring {
            if (ring == 0 && element > 0) || element >= self.elements {
                continue;
            }
            for (t, w) in GAUSS {
                let s = element as f64 + 0.5 * (t + 1.0);
                points.push((s * h, 0.5 * h * w, 1.0 - (s - ring as f64).abs()));
            }
        }
        points
    }

    /// The hat as a load on the surface nodes (two per element and one more): number and part of the unit force.
    pub fn hat(&self, ring: usize) -> Vec<(usize, f64)> {
        let h = self.dome.meridian_end_rad() / self.elements as f64;
        let mut parts = vec![0.0; 2 * self.elements + 1];
        let mut total = 0.0;
        for (angle, weight, hat) in self.quadrature(ring) {
            let element = ((angle / h) as usize).min(self.elements - 1);
            let (n, _) = quadratic(2.0 * (angle / h - element as f64) - 1.0);
            let load = weight * hat * self.dome.ring_radius_mm(angle);
            total += load;
            for (k, n) in n.into_iter().enumerate() {
                parts[2 * element + k] += load * n;
            }
        }
        parts.iter().enumerate().filter(|(_, p)| **p != 0.0).map(|(k, p)| (k, p / total)).collect()
    }

    /// Harmonic m of a ring's hat along the ring: sinc^2(m / count), 1 for the pole's harmonics.
    pub fn hat_harmonic(&self, ring: usize, m: usize) -> f64 {
        if ring == 0 || m == 0 {
            return 1.0;
        }
        let x = PI * m as f64 / self.counts[ring] as f64;
        (x.sin() / x).powi(2)
    }

    /// Harmonics that a ring's hat excites: up to its first zero; the pole has two.
    pub fn harmonics(&self, ring: usize) -> usize {
        if ring == 0 { 2 } else { self.counts[ring] }
    }
}
