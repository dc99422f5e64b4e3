//! Sparse symmetric matrices of one pattern and their factors, in dense blocks of columns.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};

use crate::dome::FactorError;

/// The pattern of positive definite matrices, and how they are factored.
#[derive(Debug)]
pub struct Cholesky {
    columns: Vec<usize>,
    rows: Vec<usize>,
    symbolic: SymbolicCholesky<usize>,
}

/// Factors of one matrix.
#[derive(Debug, Clone)]
pub struct Factors(Vec<f64>);

/// The order in which unknowns are eliminated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Elimination {
    /// Their own.
    AsNumbered,
    /// By approximate minimum degree.
    MinimumDegree,
}

impl Cholesky {
    /// For a lower triangle's pattern: where each column starts, and one end more; the columns' rows, in order.
    ///
    /// # Errors
    /// A pattern too large for memory.
    pub fn new(columns: Vec<usize>, rows: Vec<usize>, order: Elimination) -> Result<Self, FactorError> {
        let n = columns.len().saturating_sub(1);
        let view = SymbolicSparseColMatRef::new_checked(n, n, &columns, None, &rows);
        let same: Vec<usize> = (0..n).collect();
        let ordering = match order {
            // A lower triangle that is taken for ordered would be read as an upper one.
            Elimination::AsNumbered => SymmetricOrdering::Custom(PermRef::new_checked(&same, &same, n)),
            Elimination::MinimumDegree => SymmetricOrdering::Amd,
        };
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..CholeskySymbolicParams::default()
        };
        let symbolic = factorize_symbolic_cholesky(view, Side::Lower, ordering, params)
            .map_err(|error| FactorError(format!("{error:?}")))?;
        Ok(Self { columns, rows, symbolic })
    }

    /// Where each column starts, and one end more.
    pub fn columns(&self) -> &[usize] {
        &self.columns
    }

    /// The columns' rows.
    pub fn rows(&self) -> &[usize] {
        &self.rows
    }

    /// Unknowns.
    pub fn unknowns(&self) -> usize {
        self.symbolic.nrows()
    }

    /// Numbers of the factors.
    pub fn filled(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Factors the matrix of these values, in the pattern's order.
    ///
    /// # Errors
    /// A matrix that is not positive definite, or too little memory.
    pub fn factor(&self, values: &[f64]) -> Result<Factors, FactorError> {
        let n = self.unknowns();
        let view = SymbolicSparseColMatRef::new_checked(n, n, &self.columns, None, &self.rows);
        let mut factors = vec![0.0; self.filled()];
        let scratch = self.symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        let mut memory = MemBuffer::try_new(scratch).map_err(|error| FactorError(format!("{error:?}")))?;
        self.symbolic
            .factorize_numeric_llt(
                &mut factors,
                SparseColMatRef::new(view, values),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Spec::default(),
            )
            .map_err(|error| FactorError(format!("{error:?}")))?;
        Ok(Factors(factors))
    }

    /// Solves in place for right sides one after the other.
    ///
    /// # Errors
    /// Too little memory.
    pub fn solve(&self, factors: &Factors, rhs: &mut [f64]) -> Result<(), FactorError> {
        let n = self.unknowns();
        let count = rhs.len() / n.max(1);
        let scratch = self.symbolic.solve_in_place_scratch::<f64>(count, Par::Seq);
        let mut memory = MemBuffer::try_new(scratch).map_err(|error| FactorError(format!("{error:?}")))?;
        LltRef::new(&self.symbolic, &factors.0).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(rhs, n, count),
            Par::Seq,
            MemStack::new(&mut memory),
        );
        Ok(())
    }
}
