//! Bodies that move freely under an effect: what theory conserves, and a composite body beside a payload.

use nalgebra::{Matrix3, Matrix6, Quaternion, SVector, UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;

use super::{
    fixture::{still, vector},
    whole_matrix::{any_definite, values},
};
use crate::{
    BodyPart, Id, Motion, WaterPart,
    catalogue::{
        added_mass::AddedMass, payload::Payload, wall_proximity::WallProximity, waves::Waves,
    },
    effect,
};

/// A rigid body in the vacuum, with the effect's inertia and wrench added: what a simulator does.
struct Body<'a> {
    mass: f64,
    /// About the centre of mass.
    inertia: Matrix3<f64>,
    /// Centre of mass in the body's frame.
    centre: Vector3<f64>,
    part: &'a dyn BodyPart,
    p: &'a [f64],
    /// Everything that is not motion.
    around: Motion,
    /// Distance of a wall is the world's y.
    walled: bool,
}

/// Position and velocity of the origin in the world, attitude, angular velocity in the body's frame.
#[derive(Clone, Copy)]
struct State {
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    attitude: UnitQuaternion<f64>,
    angular: Vector3<f64>,
}

impl Body<'_> {
    fn motion(&self, state: &State) -> Motion {
        let mut motion = self.around.clone();
        motion.position = state.position.into();
        motion.world_from_base = state.attitude;
        motion.linear = (state.attitude.inverse() * state.velocity).into();
        motion.angular = state.angular.into();
        if self.walled {
            motion.wall = Some((state.position.y, [0.0, 1.0, 0.0]));
        }
        motion
    }

    /// Newton and Euler about the origin, with the acceleration that the world sees.
    fn acceleration(&self, state: &State) -> (Vector3<f64>, Vector3<f64>) {
        let motion = self.motion(state);
        let (m, c, omega) = (self.mass, self.centre, state.angular);
        let lever = c.cross_matrix();
        let about_origin = self.inertia - m * lever * lever;
        let mut total = Matrix6::zeros();
        total
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(Matrix3::identity() * m));
        total.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-m * lever));
        total.fixed_view_mut::<3, 3>(3, 0).copy_from(&(m * lever));
        total.fixed_view_mut::<3, 3>(3, 3).copy_from(&about_origin);
        total += self
            .part
            .inertia(self.p, &motion)
            .unwrap_or_else(Matrix6::zeros);

        let gravity = state.attitude.inverse() * Vector3::from(motion.gravity);
        let force = m * (gravity - omega.cross(&omega.cross(&c)));
        let torque = m * c.cross(&gravity) - omega.cross(&(about_origin * omega));
        let own = Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z);
        let wrench = own + Vector6::from(self.part.wrench(self.p, &motion, &[]));
        let solved = total.lu().solve(&wrench).expect("a body with mass");
        (
            state.attitude * solved.fixed_rows::<3>(0).into_owned(),
            solved.fixed_rows::<3>(3).into_owned(),
        )
    }

    /// Position, velocity, attitude and angular velocity change at these rates.
    fn rate(&self, state: &State) -> SVector<f64, 13> {
        let (linear, angular) = self.acceleration(state);
        let spin = state.attitude.quaternion() * Quaternion::from_imag(0.5 * state.angular);
        let parts = [state.velocity, linear, angular];
        SVector::from_iterator(parts.iter().flatten().chain(spin.coords.iter()).copied())
    }

    /// One step of the classical fourth-order Runge-Kutta method.
    fn step(&self, state: &State, step: f64) -> State {
        let ahead = |by: f64, rate: &SVector<f64, 13>| State {
            position: state.position + by * rate.fixed_rows::<3>(0),
            velocity: state.velocity + by * rate.fixed_rows::<3>(3),
            angular: state.angular + by * rate.fixed_rows::<3>(6),
            attitude: UnitQuaternion::from_quaternion(Quaternion::from_vector(
                state.attitude.coords + by * rate.fixed_rows::<4>(9),
            )),
        };
        let first = self.rate(state);
        let second = self.rate(&ahead(0.5 * step, &first));
        let third = self.rate(&ahead(0.5 * step, &second));
        let fourth = self.rate(&ahead(step, &third));
        ahead(step, &((first + 2.0 * (second + third) + fourth) / 6.0))
    }

    fn run(&self, mut state: State, step: f64, until: f64) -> State {
        for _ in 0..(until / step).round() as usize {
            state = self.step(&state, step);
        }
        state
    }

    /// Kinetic energy of body and water [J], and their impulse in the world [N s].
    fn energy_and_impulse(&self, state: &State) -> (f64, Vector3<f64>) {
        let motion = self.motion(state);
        let linear = Vector3::from(motion.linear);
        let at_centre = linear + state.angular.cross(&self.centre);
        let own = self.mass * at_centre.norm_squared()
            + state.angular.dot(&(self.inertia * state.angular));
        let velocity = Vector6::from_iterator(motion.linear.into_iter().chain(motion.angular));
        let added = self
            .part
            .inertia(self.p, &motion)
            .unwrap_or_else(Matrix6::zeros)
            * velocity;
        let impulse = self.mass * at_centre + added.fixed_rows::<3>(0);
        (0.5 * (own + velocity.dot(&added)), state.attitude * impulse)
    }

    /// Angular impulse of body and water about the world's origin [N m s].
    fn angular_impulse(&self, state: &State) -> Vector3<f64> {
        let motion = self.motion(state);
        let velocity = Vector6::from_iterator(motion.linear.into_iter().chain(motion.angular));
        let added = self
            .part
            .inertia(self.p, &motion)
            .unwrap_or_else(Matrix6::zeros)
            * velocity;
        let at_centre = Vector3::from(motion.linear) + state.angular.cross(&self.centre);
        let own = self.inertia * state.angular + self.mass * self.centre.cross(&at_centre);
        let about_origin = state.attitude * (own + added.fixed_rows::<3>(3));
        about_origin + state.position.cross(&self.energy_and_impulse(state).1)
    }
}

fn thrown() -> State {
    State {
        position: Vector3::new(0.0, 1.0, 0.0),
        velocity: Vector3::new(0.6, -0.2, 0.3),
        attitude: UnitQuaternion::from_euler_angles(0.3, -0.5, 1.0),
        angular: Vector3::new(0.9, -1.4, 0.6),
    }
}

fn weightless() -> Motion {
    let mut around = still();
    around.gravity = [0.0; 3];
    around
}

/// Kirchhoff: energy and impulse of body and water are conserved, however far the added mass, five times
/// the body's, is from the origin.
#[test]
fn a_body_with_much_added_mass_keeps_energy_and_impulse() {
    let mut around = weightless();
    around.middle = [0.08, -0.03, 0.05];
    let body = Body {
        mass: 2.0,
        inertia: Matrix3::from_diagonal(&Vector3::new(0.02, 0.05, 0.06)),
        centre: Vector3::new(-0.02, 0.01, 0.0),
        part: &AddedMass,
        p: &[3.0, 10.0, 7.0, 0.01, 0.1, 0.05],
        around,
        walled: false,
    };
    let start = thrown();
    let end = body.run(start, 0.002, 4.0);
    let (before, after) = (
        body.energy_and_impulse(&start),
        body.energy_and_impulse(&end),
    );
    assert!(
        (after.0 / before.0 - 1.0).abs() < 1e-6,
        "{before:?} {after:?}"
    );
    assert!(
        (after.1 - before.1).norm() < 1e-6 * before.1.norm(),
        "{before:?} {after:?}"
    );
    assert!(
        (end.velocity - start.velocity).norm() > 0.1,
        "it should tumble"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Kirchhoff with a whole matrix: energy, impulse and angular impulse of body and water are conserved, whatever the
    /// couplings and wherever the matrix acts.
    #[test]
    fn a_body_with_a_whole_added_mass_keeps_energy_and_impulse(
        matrix in any_definite(),
        point in vector(0.3),
        velocity in vector(0.7),
        angular in vector(1.2),
        is_at_middle in any::<bool>(),
    ) {
        let mut around = weightless();
        around.middle = point;
        let p = values(&matrix, (!is_at_middle).then_some(point));
        let body = Body {
            mass: 2.0,
            inertia: Matrix3::from_diagonal(&Vector3::new(0.05, 0.08, 0.09)),
            centre: Vector3::new(-0.02, 0.01, 0.03),
            part: effect(Id::AddedMass).matrix_part().expect("it takes a matrix"),
            p: &p,
            around,
            walled: false,
        };
        let start = State {
            velocity: velocity.into(),
            angular: angular.into(),
            ..thrown()
        };
        let end = body.run(start, 5e-4, 1.0);
        let (before, after) = (body.energy_and_impulse(&start), body.energy_and_impulse(&end));
        // The step's own error: a matrix may turn the body many times faster than it was thrown.
        prop_assert!((after.0 - before.0).abs() < 1e-6 * (before.0 + 1.0), "{before:?} {after:?}");
        prop_assert!((after.1 - before.1).norm() < 1e-6 * (before.1.norm() + 1.0), "{before:?} {after:?}");
        let (before, after) = (body.angular_impulse(&start), body.angular_impulse(&end));
        prop_assert!((after - before).norm() < 1e-6 * (before.norm() + 1.0), "{before:?} {after:?}");
    }
}

/// Lagrange: near a wall the added mass changes with distance, and energy is still conserved.
#[test]
fn an_added_mass_that_grows_near_a_wall_keeps_energy() {
    let mut around = weightless();
    around.middle = [0.0; 3];
    let body = Body {
        mass: 12.0,
        inertia: Matrix3::from_diagonal(&Vector3::new(0.1, 0.2, 0.3)),
        centre: Vector3::zeros(),
        part: &WallProximity,
        p: &[0.0, 0.0, 3.0, 0.4],
        around,
        walled: true,
    };
    let mut start = thrown();
    start.velocity = Vector3::new(0.4, -0.3, 0.1);
    let end = body.run(start, 0.002, 2.5);
    let (before, after) = (
        body.energy_and_impulse(&start),
        body.energy_and_impulse(&end),
    );
    assert!(
        end.position.y > 0.0 && end.position.y < 0.7,
        "{}",
        end.position.y
    );
    assert!(
        (after.0 / before.0 - 1.0).abs() < 1e-6,
        "{before:?} {after:?}"
    );
}

/// A payload against the composite rigid body, thrown in gravity: its centre of mass flies a parabola, and
/// its attitude is that of the composite inertia.
#[test]
fn a_payload_moves_as_the_composite_body() {
    let (mass, inertia) = (3.0, Matrix3::from_diagonal(&Vector3::new(0.03, 0.06, 0.08)));
    let p = [1.2, 0.2, -0.1, 0.15];
    let place = Vector3::new(p[1], p[2], p[3]);
    let laden = Body {
        mass,
        inertia,
        centre: Vector3::zeros(),
        part: &Payload,
        p: &p,
        around: still(),
        walled: false,
    };
    let start = thrown();
    let end = laden.run(start, 0.002, 2.0);

    // One body: common centre, both inertias moved to it, an effect that is none.
    let total = mass + p[0];
    let centre = place * p[0] / total;
    let moved = |mass: f64, arm: Vector3<f64>| -mass * arm.cross_matrix() * arm.cross_matrix();
    let composite = Body {
        mass: total,
        inertia: inertia + moved(mass, centre) + moved(p[0], place - centre),
        centre,
        part: &Payload,
        p: &[0.0; 4],
        around: still(),
        walled: false,
    };
    let same = composite.run(start, 0.002, 2.0);
    assert!((end.position - same.position).norm() < 1e-9);
    assert!(end.attitude.angle_to(&same.attitude) < 1e-9);

    let centre_at = |state: &State| state.position + state.attitude * centre;
    let centre_velocity = start.velocity + start.attitude * start.angular.cross(&centre);
    let parabola =
        centre_at(&start) + 2.0 * centre_velocity + 0.5 * 4.0 * Vector3::from(still().gravity);
    assert!((centre_at(&end) - parabola).norm() < 1e-6);
}

/// A body of the water's density, with any added mass, is carried by accelerating water as the water itself:
/// (rho V + M_A) a = (rho V + M_A) a_w.
#[test]
fn a_neutral_body_is_carried_by_waves() {
    let p = [0.2, 0.1, 0.05, 2.0, 0.3, 1.0];
    let mut motion = weightless();
    motion.world_from_base = thrown().attitude;
    motion.water_acceleration = Waves.acceleration(&p, [0.0; 3], 0.8);
    let added = [3.0, 10.0, 7.0, 0.01, 0.1, 0.05];
    let force = Vector6::from(motion.froude_krylov())
        + Vector6::from(AddedMass.wrench(&added, &motion, &[]));
    let mut total = AddedMass
        .inertia(&added, &motion)
        .expect("added mass has inertia");
    for axis in 0..3 {
        total[(axis, axis)] += motion.density * motion.volume;
    }
    let solved = total.lu().solve(&force).expect("a body with mass");
    let found = motion.world_from_base * solved.fixed_rows::<3>(0).into_owned();
    assert!((found - Vector3::from(motion.water_acceleration)).norm() < 1e-9);
}
