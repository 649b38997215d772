// Bundles the page into one template: page.html with style and script inside. node build.mjs [TARGET]
import { readFile, writeFile, mkdir } from "node:fs/promises";
import { dirname } from "node:path";
import { build } from "esbuild";
import { leanThree } from "./lean_three.mjs";

const target = process.argv[2] ?? "../built/page.html";
const shared = { bundle: true, minify: true, write: false, target: "es2022", logLevel: "warning" };
const script = await build({ ...shared, entryPoints: ["src/main.ts"], format: "iife", legalComments: "inline", plugins: [leanThree] });
const style = await build({ ...shared, entryPoints: ["src/style.css"] });
const skeleton = await readFile("src/page.html", "utf8");
const inside = (text) => () => text.trim();
const page = skeleton
  .replace("{{style}}", inside(style.outputFiles[0].text))
  .replace("{{script}}", inside(script.outputFiles[0].text.replaceAll("</script", "<\\/script")));
await mkdir(dirname(target), { recursive: true });
await writeFile(target, page);
