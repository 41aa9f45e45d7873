//! The plugins that were found, as the scene loader asks for them.

use std::env::consts::DLL_PREFIX;

use reef_plugin::{PluginInfo, Registry};

use crate::scene::Catalogue;

impl Catalogue for Registry {
    fn plugin(&self, id: &str) -> Result<Option<PluginInfo>, String> {
        if let Some(plugin) = self.get(id) {
            return Ok(Some(PluginInfo::clone(plugin.info())));
        }
        // What became of its file when it was loaded, or a file of that name that was refused before anybody
        // knew what is in it, says more than "there is none".
        let name = id.rsplit('.').next().unwrap_or(id).replace('-', "_");
        let refused = self.refused().iter().find(|refused| {
            let stem =
                refused.path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
            let stem = stem.strip_prefix(DLL_PREFIX).unwrap_or(&stem);
            stem.rsplit(['_', '-']).next() == Some(name.as_str())
        });
        match self.failed(id).as_ref().or(refused) {
            Some(refused) => Err(format!("{} {}", refused.path.display(), refused.reason)),
            None => Ok(None),
        }
    }

    fn ids(&self) -> Vec<String> {
        self.ids().map(str::to_owned).collect()
    }
}
