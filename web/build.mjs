// Bundles the page into farm_ar/web/static: npm ci && npm run build
import { copyFile } from "node:fs/promises";
import { build } from "esbuild";

const out = new URL("../farm_ar/web/static/", import.meta.url);

await build({
  entryPoints: [new URL("src/main.js", import.meta.url).pathname],
  outfile: new URL("play.js", out).pathname,
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  legalComments: "eof",
});
for (const name of ["index.html", "style.css"]) {
  await copyFile(new URL(`src/${name}`, import.meta.url), new URL(name, out));
}
await copyFile(new URL("node_modules/three/LICENSE", import.meta.url), new URL("three-LICENSE.txt", out));
