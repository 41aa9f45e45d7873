//! GLSL to SPIR-V, while Reef runs.

use std::path::Path;

use shaderc::{
    CompileOptions, EnvVersion, IncludeType, ResolvedInclude, ShaderKind, SpirvVersion, TargetEnv,
};

/// The compiler, loaded once.
pub struct Compiler {
    compiler: shaderc::Compiler,
}

impl Compiler {
    /// Loads the compiler.
    pub fn new() -> Result<Compiler, String> {
        let compiler = shaderc::Compiler::new().map_err(|error| error.to_string())?;
        Ok(Compiler { compiler })
    }

    /// Compiles one stage. An error names file and line.
    pub fn compile(&self, path: &Path) -> Result<Vec<u8>, String> {
        let source = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
        let kind = match path.extension().and_then(|extension| extension.to_str()) {
            Some("vert") => ShaderKind::Vertex,
            Some("frag") => ShaderKind::Fragment,
            Some("comp") => ShaderKind::Compute,
            _ => return Err(format!("{}: neither .vert nor .frag nor .comp", path.display())),
        };
        let mut options = CompileOptions::new().map_err(|error| error.to_string())?;
        options.set_target_env(TargetEnv::Vulkan, EnvVersion::Vulkan1_3 as u32);
        options.set_target_spirv(SpirvVersion::V1_6);
        options.set_warnings_as_errors();
        // Drivers optimise for themselves; what is not optimised keeps its names, and every binding that is
        // declared.
        options.set_optimization_level(shaderc::OptimizationLevel::Zero);
        options.set_include_callback(|wanted, how, from, _depth| {
            let folder = match how {
                IncludeType::Relative => Path::new(from).parent(),
                IncludeType::Standard => path.parent(),
            };
            let file = folder.unwrap_or(Path::new(".")).join(wanted);
            let content =
                std::fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
            Ok(ResolvedInclude { resolved_name: file.to_string_lossy().into_owned(), content })
        });
        let name = path.to_string_lossy();
        let artifact = self
            .compiler
            .compile_into_spirv(&source, kind, &name, "main", Some(&options))
            .map_err(|error| error.to_string())?;
        Ok(artifact.as_binary_u8().to_vec())
    }
}
