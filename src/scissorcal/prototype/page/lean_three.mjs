// Takes what the page draws with out of three.js, and leaves the rest: shaders of other materials
// are empty, those that stay lose comments and indentation; headsets and mirrored surroundings are
// left out. An esbuild plugin; tests/prototype/test_view3d.py draws with what it leaves.
import { readFile } from "node:fs/promises";
import { basename, dirname } from "node:path";

/** Blades are Phong, plates Lambert, lines Basic. */
const MATERIALS = new Set(["meshlambert", "meshphong", "meshbasic"]);
/** Begins of names of the parts of shaders that only others need, or maps, shadows and morphs. */
const UNUSED = [
  "alphahash_", "alphamap_", "aomap_", "background", "batching_", "bumpmap_", "clearcoat_", "cube_", "depth_", "displacementmap_",
  "distance", "emissivemap_", "envmap_", "equirect_", "gradientmap_", "iridescence_", "lightmap_", "lightprobes_", "lights_physical",
  "lights_toon", "linedashed_", "logdepthbuf_", "map_particle", "metalnessmap_", "morph", "normalmap_", "points_", "roughnessmap_",
  "shadow", "skinbase_", "skinning_", "skinnormal_", "sprite_", "tonemapping_", "transmission_",
];
/** Modules that the renderer makes use of only where a scene has what they are for. */
const INSTEAD = {
  "WebXRManager.js": `import { EventDispatcher } from "../../core/EventDispatcher.js";
    export class WebXRManager extends EventDispatcher {
      enabled = false; isPresenting = false; cameraAutoUpdate = false;
      getEnvironmentBlendMode() {} hasDepthSensing() { return false; } setAnimationLoop() {} dispose() {}
    }`,
  "PMREMGenerator.js": "export class PMREMGenerator {}",
  "DFGLUTData.js": "export function getDFGLUT() { return null; }",
};
const SHADERS = /[\\/]three[\\/]src[\\/]renderers[\\/]shaders[\\/]Shader(Chunk|Lib)[\\/].*\.glsl\.js$/;

export const leanThree = {
  name: "lean three",
  setup(build) {
    build.onResolve({ filter: /^three$/ }, ({ resolveDir, kind }) => build.resolve("three/src/Three.js", { resolveDir, kind }));
    build.onLoad({ filter: SHADERS }, async ({ path }) => {
      const name = basename(path, ".glsl.js");
      if (/ShaderLib/.test(path)) {
        if (!MATERIALS.has(name)) return { contents: "export const vertex = '', fragment = '';" };
      } else if (UNUSED.some((begin) => name.startsWith(begin))) return { contents: "export default '';" };
      return { contents: small(await readFile(path, "utf8")) };
    });
    build.onLoad({ filter: /[\\/]three[\\/]src[\\/].*(WebXRManager|PMREMGenerator|DFGLUTData)\.js$/ }, ({ path }) => ({
      contents: INSTEAD[basename(path)], resolveDir: dirname(path),
    }));
  },
};

/** Without comments, indentation and empty lines; lines of the preprocessor stay lines. */
function small(text) {
  const bare = text.replace(/\/\*[\s\S]*?\*\//g, "").replace(/\/\/[^\n]*/g, "");
  const lines = bare.split("\n").map((line) => line.trim()).filter(Boolean);
  return lines.map((line) => (line.startsWith("#") ? line : line.replace(/ *([=*/{}(),;<>?:&|]) */g, "$1"))).join("\n");
}
