//! A slow gel: an elastomer whose modulus relaxes after a step, as a sum of exponentials.
//!
//! E(t) / E(0) = 1 - sum g (1 - exp(-t / tau)) (a Prony series), Poisson's ratio constant. By the correspondence
//! principle (R. M. Christensen, Theory of Viscoelasticity, 1982, ch. 2) the dome's compliance C of instant forces then
//! gives u(t) = C q(t), where the forces f are the relaxation of q: f(t) = int E(t - s)/E(0) dq(s). A contact adds only
//! that each node's gap and pressure are not negative, at every time: growing contacts (E. H. Lee and J. R. M. Radok, J.
//! Appl. Mech. 27, 1960) and shrinking ones (T. C. T. Ting, J. Appl. Mech. 33, 1966) are one problem, solved node by
//! node as a whole from frame to frame, with as many turns as the motion has.
//!
//! Between two frames q is taken to go evenly. Each exponential then has one memory m with
//! m_n = rho m_(n-1) + gamma (q_n - q_(n-1)), rho = exp(-dt/tau), gamma = tau/dt (1 - rho)
//! (R. L. Taylor, K. S. Pister and G. L. Goudreau, Int. J. Numer. Methods Eng. 2, 1970), and
//! f_n = alpha q_n + r_n, alpha = 1 - sum g + sum g gamma, r_n = sum g (rho m_(n-1) - gamma q_(n-1)): an elastic contact with the
//! modulus alpha E(0) on a dome that -C r_n / alpha has moved already.

use crate::beside::Beside;
use crate::contact::Contact;
use crate::error::{ContactError, positive};
use crate::field::Field;
use crate::level::Level;
use crate::state::ContactState;

/// How a modulus relaxes: parts of the instant modulus that go, each with its time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Relaxation(Vec<RelaxationTerm>);

/// One exponential of a [`Relaxation`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelaxationTerm {
    /// Part of the instant modulus that goes, 0 to 1.
    pub part: f64,
    /// Its time, s.
    pub time_s: f64,
}

/// A gel that is left no stiffness does not hold its shape.
const MIN_RELAXED: f64 = 0.01;

impl Relaxation {
    /// A modulus that relaxes by these terms.
    ///
    /// # Errors
    /// [`ContactError::Dimension`] for a part that is negative, a time that is not positive, or parts that leave less than
    /// a hundredth of the modulus.
    pub fn new(terms: Vec<RelaxationTerm>) -> Result<Self, ContactError> {
        for term in &terms {
            if !(0.0..=1.0).contains(&term.part) {
                let (field, allowed) = ("slow_gel.terms.part", "0 to 1");
                return Err(ContactError::Dimension { field, value: term.part, allowed });
            }
            positive("slow_gel.terms.time_s", term.time_s)?;
        }
        let found = Self(terms);
        if found.relaxed() < MIN_RELAXED {
            let (field, allowed) = ("slow_gel.terms", "parts that leave 0.01 of the modulus or more");
            return Err(ContactError::Dimension { field, value: found.relaxed(), allowed });
        }
        Ok(found)
    }

    /// The terms.
    pub fn terms(&self) -> &[RelaxationTerm] {
        &self.0
    }

    /// Part of the instant modulus that is left at last.
    pub fn relaxed(&self) -> f64 {
        1.0 - self.0.iter().map(|term| term.part).sum::<f64>()
    }

    /// Part of the instant modulus that is left a time after a step.
    pub fn left_at(&self, after_s: f64) -> f64 {
        1.0 - self.0.iter().map(|term| term.part * -(-after_s / term.time_s).exp_m1()).sum::<f64>()
    }
}

/// What a slow gel remembers from frame to frame.
#[derive(Debug, Clone)]
pub struct GelMemory {
    relaxation: Relaxation,
    step_s: f64,
    /// C q / alpha of the last frame, and C m / alpha of each term.
    shape: Field,
    terms: Vec<Field>,
}

impl GelMemory {
    /// A gel at rest, and the contact that its frames are solved with: frames `step_s` apart, nothing before the first.
    /// `instant` is the dome with the modulus of a fast press.
    ///
    /// # Errors
    /// [`ContactError::NoSlowGel`] for a level other than the linear one; as [`Contact::new`].
    pub fn new(
        relaxation: Relaxation,
        step_s: f64,
        elastomer: &crate::elastomer::Elastomer,
        level: Level,
    ) -> Result<(Self, Contact), ContactError> {
        if !matches!(level, Level::Linear { .. }) {
            return Err(ContactError::NoSlowGel { level: level.name() });
        }
        let memory = Self::at_rest(relaxation, step_s)?;
        let young_mpa = elastomer.young_mpa * memory.alpha();
        let contact = Contact::new(crate::elastomer::Elastomer { young_mpa, ..*elastomer }, level)?;
        Ok((memory, contact))
    }

    /// The same with the tables of a dome that is there, whatever its modulus; `young_mpa` is that of a fast press.
    ///
    /// # Errors
    /// As [`GelMemory::new`].
    pub fn on(
        relaxation: Relaxation,
        step_s: f64,
        dome: &Contact,
        young_mpa: f64,
    ) -> Result<(Self, Contact), ContactError> {
        if !matches!(dome.level(), Level::Linear { .. }) {
            return Err(ContactError::NoSlowGel { level: dome.level().name() });
        }
        let memory = Self::at_rest(relaxation, step_s)?;
        let contact = dome.with_material(dome.elastomer().friction, young_mpa * memory.alpha())?;
        Ok((memory, contact))
    }

    fn at_rest(relaxation: Relaxation, step_s: f64) -> Result<Self, ContactError> {
        let step_s = positive("frames.step_s", step_s)?;
        let terms = vec![Field::Still; relaxation.terms().len()];
        Ok(Self { relaxation, step_s, shape: Field::Still, terms })
    }

    /// rho and gamma of a term.
    fn factors(&self, term: &RelaxationTerm) -> (f64, f64) {
        let x = self.step_s / term.time_s;
        ((-x).exp(), -(-x).exp_m1() / x)
    }

    /// Stiffness of one frame's change over the instant one.
    fn alpha(&self) -> f64 {
        let held: f64 = self.relaxation.terms().iter().map(|term| term.part * self.factors(term).1).sum();
        self.relaxation.relaxed() + held
    }

    /// How the dome has moved before the next frame's forces: what earlier ones left, relaxed until then.
    pub fn beside(&self) -> Beside {
        let mut parts = Vec::with_capacity(self.terms.len() + 1);
        let mut of_shape = 0.0;
        for (term, memory) in self.relaxation.terms().iter().zip(&self.terms) {
            let (rho, gamma) = self.factors(term);
            parts.push((-term.part * rho, memory));
            of_shape += term.part * gamma;
        }
        parts.push((of_shape, &self.shape));
        Beside(Field::sum(&parts))
    }

    /// Takes in a frame's contacts, solved with [`GelMemory::beside`].
    pub fn take<'s>(&mut self, states: impl Iterator<Item = &'s ContactState>) {
        // alpha C q / alpha = C f / alpha + beside.
        let moved = self.beside().with(states).0;
        let shape = Field::sum(&[(1.0 / self.alpha(), &moved)]);
        let terms = self.relaxation.terms().iter().zip(&self.terms).map(|(term, memory)| {
            let (rho, gamma) = self.factors(term);
            Field::sum(&[(rho, memory), (gamma, &shape), (-gamma, &self.shape)])
        });
        self.terms = terms.collect();
        self.shape = shape;
    }
}
