//! A URDF. What is accepted has finite masses and volumes.

use hydro_model::robot::Robot;

use super::{folder, refused};

/// Reads a robot.
pub fn read(bytes: &[u8]) -> bool {
    let path = folder::put("urdf/robot.urdf", bytes);
    match Robot::from_urdf(&path) {
        Ok(robot) => {
            let numbers = [robot.mass(), robot.displaced_volume()];
            assert!(numbers.iter().all(|number| *number >= 0.0), "{numbers:?}");
            assert_eq!(robot.joint_names().len(), robot.joints.len());
            assert!(robot.bodies.len() <= robot.links.len());
            true
        }
        Err(error) => refused(&error),
    }
}
