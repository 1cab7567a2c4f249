//! Basis pursuit denoising in any orthonormal basis, by a primal-dual interior-point method
//! (Boyd & Vandenberghe 2004, section 11.7) with Mehrotra's predictor-corrector step (1992).
//!
//! ```text
//! min Σ t   subject to   −t ≤ φᵀx ≤ t,   x ≥ 0,   ½(ε² − ‖y − Ax‖²) ≥ 0
//! ```
//!
//! with multipliers ½(1 + s) and ½(1 − s), w, and λ. The Karush–Kuhn–Tucker (KKT) conditions are `φs = w + λAᵀ(y − Ax)`
//! and complementarity: each constraint's slack times its multiplier is zero. Newton's method drives these products to
//! a common μ that falls from step to step. Eliminating t, s, w and λ leaves one system in x, `[k, k]`, to factor for
//! each of ten to twenty steps. Splitting methods have cheaper steps but need thousands: with few patterns, or ε near
//! ‖y‖, the problem is almost a linear program.

use super::dual_bound::{BpdnConstraint, BpdnSolution};
use super::iterate::Iterate;
use super::newton::NewtonSystem;
use super::sensing_operator::SensingOperator;
use crate::linalg::{dot, vectorise};

/// Relative duality gap at which a solution is accepted; noise changes the objective by far more.
const MAX_RELATIVE_GAP: f64 = 2e-3;
/// The dual bound is computed once the complementarity is at most this many times the accepted gap.
const DUAL_BOUND_RATIO: f64 = 10.0;
/// Steps are not halved below this share of their length.
const MIN_STEP_SHARE: f64 = 1e-2;
/// Limit of Newton steps, several times the usual number.
const MAX_STEPS: usize = 60;

/// Minimises `‖φᵀx‖₁`. The solution is non-negative, and `‖y − Ax‖ ≤ epsilon` to rounding; where no x satisfies that,
/// it is the least-squares solution.
pub(in crate::recover) fn solve(
    operator: &SensingOperator,
    constraint: &BpdnConstraint,
) -> BpdnSolution {
    // Zero is the solution if it is feasible.
    let zero_is_feasible = dot(constraint.y, constraint.y).sqrt() <= constraint.epsilon;
    let x = match zero_is_feasible {
        true => vec![0.0; operator.unknowns()],
        false => constraint.least_squares.to_vec(),
    };
    let mut best = BpdnSolution {
        objective: operator.objective(&x),
        x,
        bound: 0.0,
    };
    let residual = operator.residual(constraint.least_squares, constraint.y);
    if !zero_is_feasible && dot(&residual, &residual).sqrt() < constraint.epsilon {
        vectorise(
            #[cfg_attr(target_arch = "x86_64", inline(always))]
            || iterate(operator, constraint, &mut best),
        );
    }
    best
}

/// Improves `best`, which is feasible, until its gap is small enough or a step fails.
#[cfg_attr(target_arch = "x86_64", inline(always))]
fn iterate(operator: &SensingOperator, constraint: &BpdnConstraint, best: &mut BpdnSolution) {
    let Some(mut point) = Iterate::new(operator, constraint) else {
        return;
    };
    for _ in 0..MAX_STEPS {
        if point.complementarity() <= DUAL_BOUND_RATIO * MAX_RELATIVE_GAP * best.objective {
            best.record(operator, constraint, point.x.clone(), &point.s);
            if best.relative_gap() <= MAX_RELATIVE_GAP {
                return;
            }
        }
        let Some(system) = NewtonSystem::new(operator, &point) else {
            break;
        };
        let step = system.predictor_corrector_step();
        let mut share = 1.0;
        // Rounding can end a step beyond a constraint.
        point = loop {
            let mut next = point.clone();
            next.take_step(operator, constraint, &step, share);
            if next.is_strictly_feasible() {
                break next;
            }
            share *= 0.5;
            if share < MIN_STEP_SHARE {
                return;
            }
        };
    }
    best.record(operator, constraint, point.x.clone(), &point.s);
}

#[cfg(all(test, not(target_arch = "wasm32")))] // where there is proptest
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::linalg;
    use crate::recover::common_mode_weight::CommonModeWeight;
    use crate::recover::gram_cache::WindowEquations;
    use crate::recover::normal_equations::{EquationWeights, WeightedColumns};
    use crate::recover::test_problems::Problem;
    use crate::recover::{Homotopy, Nnls, SparsityBasis};

    const SIDE: usize = 5;

    /// A problem for a window of 5 × 5 elements, of which the first `missing` are outside the light plane.
    fn random_problem(rows: usize, missing: usize, seed: u64) -> (Problem, WindowEquations) {
        let slots: Vec<usize> = (missing..SIDE * SIDE).collect();
        let problem = Problem::random(slots.len(), rows, seed, 0.5);
        let columns = linalg::transpose(&problem.matrix, slots.len());
        let weights = EquationWeights::uniform(rows, CommonModeWeight::FULL);
        let equations = WindowEquations {
            slots,
            columns: WeightedColumns::new(columns, weights),
            gram: problem.gram(),
        };
        (problem, equations)
    }

    fn norm_in_basis(basis: SparsityBasis, missing: usize, x: &[f64]) -> f64 {
        let side = SIDE;
        let b = basis.along_axis(side);
        let mut total = 0.0f64;
        for p in 0..side {
            for q in 0..side {
                let mut coefficient = 0.0;
                for (i, &x) in x.iter().enumerate() {
                    let (v, u) = ((i + missing) / side, (i + missing) % side);
                    coefficient += b[p * side + v] * b[q * side + u] * x;
                }
                total += coefficient.abs();
            }
        }
        total
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        /// For ε from 2 % of ‖y‖ to above it: feasible to rounding, non-negative, the stated objective, and a
        /// small gap to a lower bound; least squares where nothing is feasible, zero where zero is.
        #[test]
        fn solutions_are_feasible_with_a_small_duality_gap(
            dct in any::<bool>(), rows in 4usize..30, missing in 0usize..8, seed in any::<u64>(),
            share in 0.02f64..1.1,
        ) {
            let basis = if dct { SparsityBasis::Dct } else { SparsityBasis::Haar };
            let (problem, equations) = random_problem(rows, missing, seed);
            let operator = SensingOperator::new(basis, &equations, SIDE);
            let gram = problem.gram();
            let k = 25 - missing;
            let mut nnls = Nnls::new(&gram, k);
            for y in &problem.measurements {
                let least_squares = nnls.solve(&problem.right_hand_side(y));
                let least = problem.residual(&least_squares, y);
                let norm = Problem::energy(y).sqrt();
                let epsilon = share * norm;
                let constraint = BpdnConstraint { y, epsilon, least_squares: &least_squares };
                let solution = solve(&operator, &constraint);
                prop_assert!(solution.x.iter().all(|&x| x >= 0.0));
                let objective = norm_in_basis(basis, missing, &solution.x);
                prop_assert!((objective - solution.objective).abs() <= 1e-9 * (1.0 + objective));
                if epsilon < norm && epsilon <= least {
                    prop_assert_eq!(&solution.x, &least_squares);
                    continue;
                }
                let residual = problem.residual(&solution.x, y);
                prop_assert!(residual <= epsilon + 1e-9 * norm, "{residual} > {epsilon}");
                prop_assert!(solution.bound <= objective * (1.0 + 1e-9));
                prop_assert!(
                    objective - solution.bound <= MAX_RELATIVE_GAP * objective,
                    "{objective} is not near {} at {share}, least {}", solution.bound, least / norm
                );
            }
        }

        /// With φ = I the homotopy is an independent solver of the same problem.
        #[test]
        fn agrees_with_the_homotopy(rows in 4usize..30, seed in any::<u64>(), share in 0.02f64..0.98) {
            let (problem, equations) = random_problem(rows, 0, seed);
            let operator = SensingOperator::new(SparsityBasis::Identity, &equations, SIDE);
            let gram = problem.gram();
            for y in &problem.measurements {
                let h = problem.right_hand_side(y);
                let least_squares = Nnls::new(&gram, 25).solve(&h);
                let least = problem.residual(&least_squares, y);
                let epsilon = least + share * (Problem::energy(y).sqrt() - least);
                let exact = Homotopy::new(&gram, 25).solve(&h, Problem::energy(y), epsilon);
                let constraint = BpdnConstraint { y, epsilon, least_squares: &least_squares };
                let found = solve(&operator, &constraint);
                let best: f64 = exact.iter().sum();
                prop_assert!((found.objective - best).abs() <= MAX_RELATIVE_GAP * best + 1e-9);
            }
        }
    }

    /// A step whose end is infeasible by rounding was the last one, with a gap of 0.57 %.
    #[test]
    fn steps_that_end_beyond_a_constraint_are_shortened() {
        let (problem, equations) = random_problem(5, 3, 11_018_186_926_858_098_162);
        let operator = SensingOperator::new(SparsityBasis::Haar, &equations, SIDE);
        let mut solved = 0;
        for y in &problem.measurements {
            let least_squares = Nnls::new(&problem.gram(), 22).solve(&problem.right_hand_side(y));
            let epsilon = 0.076_755_374_517_008_23 * Problem::energy(y).sqrt();
            let constraint = BpdnConstraint {
                y,
                epsilon,
                least_squares: &least_squares,
            };
            if problem.residual(&least_squares, y) < epsilon {
                let solution = solve(&operator, &constraint);
                assert!(solution.relative_gap() <= MAX_RELATIVE_GAP);
                solved += 1;
            }
        }
        assert!(solved > 0);
    }

    #[test]
    fn measurements_within_the_tolerance_give_zero() {
        let (problem, equations) = random_problem(30, 0, 7);
        let operator = SensingOperator::new(SparsityBasis::Haar, &equations, SIDE);
        let y = &problem.measurements[0];
        let least_squares = Nnls::new(&problem.gram(), 25).solve(&problem.right_hand_side(y));
        let constraint = BpdnConstraint {
            y,
            epsilon: 1.01 * Problem::energy(y).sqrt(),
            least_squares: &least_squares,
        };
        let solution = solve(&operator, &constraint);
        assert!(solution.x.iter().all(|&x| x == 0.0) && solution.objective == 0.0);
    }

    #[test]
    fn an_infeasible_constraint_gives_least_squares() {
        let (problem, equations) = random_problem(30, 0, 7);
        let operator = SensingOperator::new(SparsityBasis::Dct, &equations, SIDE);
        let y = &problem.measurements[0];
        let least_squares = Nnls::new(&problem.gram(), 25).solve(&problem.right_hand_side(y));
        let epsilon = 0.5 * problem.residual(&least_squares, y);
        let constraint = BpdnConstraint {
            y,
            epsilon,
            least_squares: &least_squares,
        };
        let solution = solve(&operator, &constraint);
        for (x, least) in solution.x.iter().zip(&least_squares) {
            assert!((x - least).abs() < 1e-9);
        }
    }
}
