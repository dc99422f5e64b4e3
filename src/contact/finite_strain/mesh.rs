//! Hexahedra of a hemisphere: an inner box and five blocks about it, finest where an object touches.
//!
//! The blocks are laid out about the pole of the unit half ball. A hyperbolic translation of the ball then takes the pole
//! to where the object touches: it keeps sphere and base plane, is conformal, so that no element is sheared, and makes the
//! elements smaller by the cosine of the angle it moves the pole by (J. G. Ratcliffe, Foundations of Hyperbolic Manifolds,
//! 2006, eq. 4.5.5).

use glam::DVec3;

/// What a mesh is laid out for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Grading {
    /// Radius of the hemisphere, mm.
    pub radius_mm: f64,
    /// Middle of the fine patch on the unit sphere.
    pub middle: DVec3,
    /// Half the angle of the fine patch between the middles of its edges, rad.
    pub patch_rad: f64,
    /// Elements across the patch.
    pub across: usize,
}

/// Furthest from the pole that the fine patch's middle is put, rad: the elements shrink by the cosine.
const MAX_TURN_RAD: f64 = 1.25;
/// Half width and height of the inner box, as parts of the radius.
const BOX: [f64; 2] = [0.28, 0.42];
/// How much smaller elements are at the middle of the patch, towards the patch on the sides, and towards the surface.
const FINER: [f64; 3] = [0.25, 0.5, 0.55];

/// The hemisphere's mesh, nodes numbered so that its matrix fills little when it is factored.
#[derive(Debug)]
pub(crate) struct Mesh {
    pub grading: Grading,
    /// Node positions, mm.
    pub nodes_mm: Vec<DVec3>,
    /// Triquadratic hexahedra; the first local coordinate runs fastest.
    pub elements: Vec<[u32; 27]>,
    /// Biquadratic faces of the dome's surface.
    pub faces: Vec<[u32; 9]>,
    /// Nodes on the bonded base.
    pub is_base: Vec<bool>,
    lattice: Lattice,
}

/// Numbers of cells: across the patch, up the sides, through the shell.
#[derive(Debug, Clone, Copy)]
struct Lattice {
    across: usize,
    up: usize,
    through: usize,
}

/// One of the five patches of the surface.
#[derive(Debug, Clone, Copy)]
enum Patch {
    Top,
    Right,
    Left,
    Back,
    Front,
}

const PATCHES: [Patch; 5] = [Patch::Top, Patch::Right, Patch::Left, Patch::Back, Patch::Front];

impl Lattice {
    fn index(&self, [i, j, k, layer]: [usize; 4]) -> usize {
        let side = 2 * self.across + 1;
        ((layer * (2 * self.up + 1) + k) * side + j) * side + i
    }

    /// Cells of a patch along its two coordinates, which with the outward direction are right-handed.
    fn cells(&self, patch: Patch) -> [usize; 2] {
        match patch {
            Patch::Top => [self.across, self.across],
            Patch::Right | Patch::Front => [self.across, self.up],
            Patch::Left | Patch::Back => [self.up, self.across],
        }
    }

    /// The lattice's point of a patch's coordinates, in half cells.
    fn on(&self, patch: Patch, p: usize, q: usize) -> [usize; 3] {
        let end = 2 * self.across;
        match patch {
            Patch::Top => [p, q, 2 * self.up],
            Patch::Right => [end, p, q],
            Patch::Left => [0, q, p],
            Patch::Back => [q, end, p],
            Patch::Front => [p, 0, q],
        }
    }
}

/// A part from 0 to 1 whose steps shrink towards 1.
fn towards_end(part: f64, finer: f64) -> f64 {
    part * (1.0 + finer * (1.0 - part))
}

impl Grading {
    /// Parts of the patch's half width, finer in its middle.
    fn angle(&self, x: f64) -> f64 {
        self.patch_rad * x * (1.0 - FINER[0] * (1.0 - x * x))
    }

    /// Place in the unit half ball, the patch about its pole; lattice coordinates in half cells.
    fn place(&self, lattice: &Lattice, [i, j, k, layer]: [usize; 4]) -> DVec3 {
        let across = lattice.across as f64;
        let (x, y) = (i as f64 / across - 1.0, j as f64 / across - 1.0);
        let z = k as f64 / (2 * lattice.up) as f64;
        let tangent = self.patch_rad.tan();
        let [gx, gy] = [x, y].map(|x| self.angle(x).tan());
        let inner = DVec3::new(gx / tangent * BOX[0], gy / tangent * BOX[0], z * BOX[1]);
        if layer == 0 {
            return inner;
        }
        let polar = std::f64::consts::FRAC_PI_2
            - (std::f64::consts::FRAC_PI_2 - self.patch_rad) * towards_end(z, FINER[1]);
        let height = if k == 0 { 0.0 } else { tangent / polar.tan() };
        let outer = DVec3::new(gx, gy, height).normalize_or(DVec3::Z);
        inner.lerp(outer, towards_end(layer as f64 / (2 * lattice.through) as f64, FINER[2]))
    }

    /// The hyperbolic translation that takes the pole to the patch's middle; `back` undoes it.
    fn moved(&self, x: DVec3, back: bool) -> DVec3 {
        let flat = DVec3::new(self.middle.x, self.middle.y, 0.0).normalize_or_zero();
        let turn = self.middle.z.clamp(-1.0, 1.0).acos().min(MAX_TURN_RAD);
        let a = flat * (if back { -0.5 * turn } else { 0.5 * turn }).tan();
        let (aa, ax, xx) = (a.length_squared(), a.dot(x), x.length_squared());
        (a * (1.0 + 2.0 * ax + xx) + x * (1.0 - aa)) / (1.0 + 2.0 * ax + aa * xx)
    }
}

impl Mesh {
    /// Lays the blocks out.
    pub fn new(grading: Grading) -> Self {
        let across = grading.across;
        let lattice = Lattice { across, up: across.div_ceil(4).max(2), through: across.div_ceil(3).max(2) };
        let mut numbers = vec![u32::MAX; lattice.index([0, 0, 0, 2 * lattice.through + 1])];
        let (mut places, mut is_base) = (Vec::new(), Vec::new());
        let mut number = |key: [usize; 4]| {
            let at = &mut numbers[lattice.index(key)];
            if *at == u32::MAX {
                *at = places.len() as u32;
                places.push(grading.place(&lattice, key));
                is_base.push(key[2] == 0);
            }
            *at
        };
        let local = |k: usize| [k % 3, k / 3 % 3, k / 9];
        let (mut elements, mut faces) = (Vec::new(), Vec::new());
        for cell in 0..across * across * lattice.up {
            let at = [cell % across, cell / across % across, cell / (across * across)];
            elements.push(std::array::from_fn(|k| {
                let [p, q, r] = local(k);
                number([2 * at[0] + p, 2 * at[1] + q, 2 * at[2] + r, 0])
            }));
        }
        for patch in PATCHES {
            let [first, second] = lattice.cells(patch);
            for cell in 0..first * second {
                let (a, b) = (cell % first, cell / first);
                let mut of = |p: usize, q: usize, layer: usize| {
                    let [i, j, k] = lattice.on(patch, 2 * a + p, 2 * b + q);
                    number([i, j, k, layer])
                };
                for layer in 0..lattice.through {
                    elements.push(std::array::from_fn(|k| {
                        let [p, q, r] = local(k);
                        of(p, q, 2 * layer + r)
                    }));
                }
                faces.push(std::array::from_fn(|k| of(k % 3, k / 3, 2 * lattice.through)));
            }
        }
        let nodes_mm = places.iter().map(|x| grading.moved(*x, false) * grading.radius_mm).collect();
        let mut mesh = Self { grading, nodes_mm, elements, faces, is_base, lattice };
        mesh.renumber(&places);
        mesh
    }

    /// Numbers the nodes by nested dissection (A. George, SIAM J. Numer. Anal. 10, 1973): what two halves share comes after
    /// both.
    fn renumber(&mut self, places: &[DVec3]) {
        let middle = |element: &[u32; 27]| element.iter().map(|n| places[*n as usize]).sum::<DVec3>() / 27.0;
        let middles: Vec<DVec3> = self.elements.iter().map(middle).collect();
        let mut order = Order { mesh: self, middles, taken: vec![false; places.len()], order: Vec::new() };
        let mut all: Vec<u32> = (0..self.elements.len() as u32).collect();
        order.dissect(&mut all);
        let order = order.order;
        let mut new = vec![0_u32; places.len()];
        for (number, old) in order.iter().enumerate() {
            new[*old as usize] = number as u32;
        }
        self.nodes_mm = order.iter().map(|old| self.nodes_mm[*old as usize]).collect();
        self.is_base = order.iter().map(|old| self.is_base[*old as usize]).collect();
        self.elements.iter_mut().flatten().for_each(|node| *node = new[*node as usize]);
        self.faces.iter_mut().flatten().for_each(|node| *node = new[*node as usize]);
    }

    /// The face over a direction from the base's centre, and the local coordinates there, from -1 to 1.
    pub fn locate(&self, direction: DVec3) -> (usize, [f64; 2]) {
        let grading = &self.grading;
        let x = grading.moved(direction, true);
        let tangent = grading.patch_rad.tan();
        let side = x.x.abs().max(x.y.abs());
        let up = x.z.max(0.0);
        let across = |v: f64| self.cell(self.lattice.across, 0.5 * (1.0 + grading.part(v.atan())));
        if side <= up * tangent {
            let ((a, xi), (b, eta)) = (across(x.x / up), across(x.y / up));
            return (b * self.lattice.across + a, [xi, eta]);
        }
        let patch_rad = grading.patch_rad;
        let polar = side.atan2(up);
        let quarter = std::f64::consts::FRAC_PI_2;
        let value = ((quarter - polar) / (quarter - patch_rad)).clamp(0.0, 1.0);
        // t (1 + s (1 - t)) = value
        let s = FINER[1];
        let z = 2.0 * value / (1.0 + s + ((1.0 + s).powi(2) - 4.0 * s * value).max(0.0).sqrt());
        let (b, eta) = self.cell(self.lattice.up, z);
        let scale = tangent / side;
        let patch = match (x.x.abs() >= x.y.abs(), x.x >= 0.0, x.y >= 0.0) {
            (true, true, _) => 1,
            (true, false, _) => 2,
            (false, _, true) => 3,
            (false, _, false) => 4,
        };
        let (a, xi) = across(scale * if patch < 3 { x.y } else { x.x });
        let before: usize =
            PATCHES[..patch].iter().map(|p| self.lattice.cells(*p).iter().product::<usize>()).sum();
        match PATCHES[patch] {
            Patch::Right | Patch::Front => (before + b * self.lattice.across + a, [xi, eta]),
            _ => (before + a * self.lattice.up + b, [eta, xi]),
        }
    }

    /// The cell of a part from 0 to 1, and the local coordinate in it.
    fn cell(&self, count: usize, part: f64) -> (usize, f64) {
        let at = part.clamp(0.0, 1.0) * count as f64;
        let cell = (at as usize).min(count - 1);
        (cell, 2.0 * (at - cell as f64) - 1.0)
    }
}

impl Grading {
    /// The inverse of [`Self::angle`].
    fn part(&self, angle: f64) -> f64 {
        let goal = angle / self.patch_rad;
        let (slope, cubic) = (1.0 - FINER[0], FINER[0]);
        let mut x = goal.clamp(-1.0, 1.0);
        // Rising and convex away from zero: Newton's steps end within a few.
        for _ in 0..8 {
            x -= (x * (slope + cubic * x * x) - goal) / (slope + 3.0 * cubic * x * x);
        }
        x
    }
}

/// A dissection under way.
struct Order<'a> {
    mesh: &'a Mesh,
    middles: Vec<DVec3>,
    taken: Vec<bool>,
    order: Vec<u32>,
}

impl Order<'_> {
    fn take(&mut self, elements: &[u32], into: &mut Vec<u32>, only: Option<&[bool]>) {
        for element in elements {
            for &node in &self.mesh.elements[*element as usize] {
                if !self.taken[node as usize] && only.is_none_or(|only| only[node as usize]) {
                    self.taken[node as usize] = true;
                    into.push(node);
                }
            }
        }
    }

    fn dissect(&mut self, elements: &mut [u32]) {
        if elements.len() <= 2 {
            let mut own = Vec::new();
            self.take(elements, &mut own, None);
            self.order.extend(own);
            return;
        }
        let at = |element: &u32| self.middles[*element as usize];
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for element in elements.iter() {
            (low, high) = (low.min(at(element)), high.max(at(element)));
        }
        let extent = (high - low).to_array();
        let axis = (0..3).max_by(|a, b| extent[*a].total_cmp(&extent[*b])).unwrap_or(0);
        elements.sort_by(|a, b| at(a).to_array()[axis].total_cmp(&at(b).to_array()[axis]).then(a.cmp(b)));
        let (left, right) = elements.split_at_mut(elements.len() / 2);
        let mut in_right = vec![false; self.taken.len()];
        for element in right.iter() {
            for &node in &self.mesh.elements[*element as usize] {
                in_right[node as usize] = true;
            }
        }
        let mut shared = Vec::new();
        self.take(left, &mut shared, Some(&in_right));
        self.dissect(left);
        self.dissect(right);
        self.order.extend(shared);
    }
}
