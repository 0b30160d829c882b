//! One load cell: its attributes, checked once and packed into `plugin_data`.

use crate::mujoco::ffi::{ModelView, bindings::mjOBJ_SITE};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    Force,
    Torque,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Include {
    Plugin,
    All,
}

/// One load cell; small enough to be `plugin_data` itself, so a copied `mjData` carries it whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LoadCell {
    pub(super) site: usize,
    pub(super) quantity: Quantity,
    pub(super) include: Include,
}

impl LoadCell {
    pub(super) fn to_bits(self) -> usize {
        self.site << 3
            | usize::from(self.include == Include::All) << 2
            | usize::from(self.quantity == Quantity::Torque) << 1
            | 1
    }

    /// `None` for 0, a cell that was never made.
    pub(super) fn from_bits(bits: usize) -> Option<Self> {
        (bits & 1 == 1).then_some(Self {
            site: bits >> 3,
            include: if bits & 4 == 0 {
                Include::Plugin
            } else {
                Include::All
            },
            quantity: if bits & 2 == 0 {
                Quantity::Force
            } else {
                Quantity::Torque
            },
        })
    }

    pub(super) fn from_attributes(model: ModelView<'_>, id: usize) -> Result<Self, String> {
        let value = |name| {
            model
                .attribute(id, name)
                .map(|text| text.trim().to_owned())
                .filter(|text| !text.is_empty())
        };
        let sites = || -> String {
            let names: Vec<String> = (0..model.site_bodyid().len())
                .map(|site| model.name(mjOBJ_SITE as i32, site))
                .filter(|name| !name.is_empty())
                .collect();
            if names.is_empty() {
                "none".to_owned()
            } else {
                names.join(", ")
            }
        };
        let site = value("site").ok_or_else(|| {
            format!(
                "attribute `site` is missing; name the site of the cell. The model's sites are: {}",
                sites()
            )
        })?;
        let found = model.id(mjOBJ_SITE as i32, &site).ok_or_else(|| {
            format!(
                "attribute `site` is `{site}`; the model's sites are: {}",
                sites()
            )
        })?;
        if model.site_bodyid()[found] == 0 {
            return Err(format!(
                "attribute `site` is `{site}`, which sits on the world; a load cell measures between a body \
                 and its parent, so put the site on the body below the cell"
            ));
        }
        let quantity = match value("quantity").as_deref() {
            None | Some("force") => Quantity::Force,
            Some("torque") => Quantity::Torque,
            Some(other) => {
                return Err(format!(
                    "attribute `quantity` is `{other}`; expected `force` or `torque`"
                ));
            }
        };
        let include = match value("include").as_deref() {
            None | Some("plugin") => Include::Plugin,
            Some("all") => Include::All,
            Some(other) => {
                return Err(format!(
                    "attribute `include` is `{other}`; expected `plugin` or `all`"
                ));
            }
        };
        Ok(Self {
            site: found,
            quantity,
            include,
        })
    }
}

/// True where the load cell of this instance measures force, false for torque; `None` where it is no load cell.
pub(crate) fn measures_force(model: ModelView<'_>, instance: usize) -> Option<bool> {
    model.attribute(instance, "include")?;
    let cell = LoadCell::from_attributes(model, instance).ok()?;
    Some(cell.quantity == Quantity::Force)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_fits_into_plugin_data() {
        for site in [0, 1, 77] {
            for quantity in [Quantity::Force, Quantity::Torque] {
                for include in [Include::Plugin, Include::All] {
                    let cell = LoadCell {
                        site,
                        quantity,
                        include,
                    };
                    assert_eq!(LoadCell::from_bits(cell.to_bits()), Some(cell));
                }
            }
        }
        assert_eq!(LoadCell::from_bits(0), None);
    }
}
