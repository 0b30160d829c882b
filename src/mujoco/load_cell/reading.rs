//! The reading of a load cell: MuJoCo's interaction force, less the force of the water.

use nalgebra::Vector3;

use super::cell::{Include, LoadCell, Quantity};
use crate::{
    mujoco::{
        bodies::{
            fluid_loads,
            joint_space::{rotation, vector},
        },
        effects::forces,
        ffi::{DataView, bindings::mjDSBL_GRAVITY},
        wrench::{
            applied::applied,
            instance_effects::{with_effects, with_sources},
            instances::instances,
        },
    },
    plugin::native_fluid::Load,
};

/// Force and torque in the world about a fixed point.
struct About {
    point: Vector3<f64>,
    sum: Load,
}

impl About {
    fn add(&mut self, at: Vector3<f64>, force: Vector3<f64>, torque: Vector3<f64>) {
        self.sum.force += force;
        self.sum.torque += torque + (at - self.point).cross(&force);
    }
}

impl LoadCell {
    /// Force [N] or torque [N m], in the site's frame.
    pub(super) fn reading(self, data: &mut DataView<'_>) -> Vector3<f64> {
        let model = data.model();
        let body = model.site_bodyid()[self.site] as usize;
        let root = model.body_rootid()[body] as usize;
        let point = vector(data.site_xpos(), self.site);
        let mut water = About {
            point,
            sum: Load::default(),
        };
        if !model.passive_is_off() {
            let instances: Vec<usize> = instances(model).collect();
            for instance in instances {
                let Some(now) = applied(data, instance) else {
                    continue;
                };
                if model.hangs_below(now.body, body) {
                    let world_from_base = rotation(data.xmat(), now.body);
                    let force = world_from_base * Vector3::from(now.wrench.force);
                    let torque = world_from_base * Vector3::from(now.wrench.torque);
                    water.add(vector(data.xpos(), now.body), force, torque);
                }
            }
            let instances = with_effects(data);
            with_sources(data, &instances, |data, sources| {
                forces::on_subtree(data, sources, body, 0, |at, force, torque| {
                    water.add(at, force, torque);
                });
            });
            if self.include == Include::All {
                for link in (body..model.bodies()).filter(|link| model.hangs_below(*link, body)) {
                    add_native(data, link, &mut water);
                }
            }
        }
        // MuJoCo's own: (torque, force) about the centre of mass of the tree, in the world.
        let internal = &data.cfrc_int()[6 * body..6 * body + 6];
        let centre = vector(data.subtree_com(), root);
        let mut reading = About {
            point,
            sum: Load::default(),
        };
        reading.add(
            centre,
            Vector3::new(internal[3], internal[4], internal[5]),
            Vector3::new(internal[0], internal[1], internal[2]),
        );
        let world_from_site = rotation(data.site_xmat(), self.site);
        match self.quantity {
            Quantity::Force => world_from_site.tr_mul(&(reading.sum.force - water.sum.force)),
            Quantity::Torque => world_from_site.tr_mul(&(reading.sum.torque - water.sum.torque)),
        }
    }
}

/// Adds the forces of MuJoCo's fluid and gravity compensation on one body.
fn add_native(data: &DataView<'_>, body: usize, water: &mut About) {
    let model = data.model();
    let option = &model.raw().opt;
    let mass = model.body_mass()[body];
    let compensation = model.body_gravcomp()[body];
    let gravity_is_on = option.disableflags & mjDSBL_GRAVITY as i32 == 0;
    if gravity_is_on {
        let force = -compensation * mass * Vector3::from(option.gravity);
        water.add(vector(data.xipos(), body), force, Vector3::zeros());
    }
    let wind = Vector3::from(option.wind);
    fluid_loads::loads(
        data,
        body,
        |_| wind,
        |at, force, torque| {
            water.add(at, force, torque);
        },
    );
}
