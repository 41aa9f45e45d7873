//! The plugins that were found, as the scene loader asks for them.

use reef_plugin as plugin;
use reef_plugin::Registry;

use crate::scene::{Catalogue, ParamInfo, ParamKind, PluginInfo};

impl Catalogue for Registry {
    fn plugin(&self, id: &str) -> Result<Option<PluginInfo>, String> {
        if let Some(plugin) = self.get(id) {
            return Ok(Some(known(plugin.info())));
        }
        // A file of that name that was refused says more than "there is none".
        let name = id.rsplit('.').next().unwrap_or(id).replace('-', "_");
        let refused = self.refused().iter().find(|refused| {
            let stem =
                refused.path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
            stem.rsplit(['_', '-']).next() == Some(name.as_str())
        });
        match refused {
            Some(refused) => Err(format!("{} {}", refused.path.display(), refused.reason)),
            None => Ok(None),
        }
    }

    fn ids(&self) -> Vec<String> {
        self.infos().map(|info| info.id.clone()).collect()
    }
}

/// What the loader has to know of a plugin's description.
pub fn known(info: &plugin::PluginInfo) -> PluginInfo {
    let params = info.params.iter().map(|param| ParamInfo {
        id: param.id,
        key: param.key.clone(),
        unit: param.unit.clone(),
        help: param.help.clone(),
        kind: match param.kind {
            plugin::ParamKind::Float => ParamKind::Float { minimum: param.minimum, maximum: param.maximum },
            plugin::ParamKind::Int => ParamKind::Int { minimum: param.minimum, maximum: param.maximum },
            plugin::ParamKind::Switch => ParamKind::Switch,
            plugin::ParamKind::Choice => ParamKind::Choice(param.choices.clone()),
        },
        default: param.default,
    });
    PluginInfo { config_schema: info.config_schema.clone(), params: params.collect() }
}
