import { createHash } from "node:crypto";
import { readdirSync, readFileSync } from "node:fs";
import { dirname, join, relative } from "node:path";
import { fileURLToPath } from "node:url";
import { defineConfig, type Plugin } from "vite";

const HERE = dirname(fileURLToPath(import.meta.url));

/** A digest of what the page is built from, kept in the page: a test can tell a stale build. */
function sourcesDigest(): string {
  const files = readdirSync(join(HERE, "src"), { recursive: true, withFileTypes: true })
    .filter((entry) => entry.isFile())
    .map((entry) => relative(HERE, join(entry.parentPath, entry.name)).replaceAll("\\", "/"));
  const digest = createHash("sha256");
  for (const name of [...files, "index.html", "package-lock.json"].sort()) {
    digest.update(name).update("\0").update(readFileSync(join(HERE, name)));
  }
  return digest.digest("hex");
}

const marked: Plugin = {
  name: "sources-digest",
  transformIndexHtml: () => [{ tag: "meta", attrs: { name: "sources", content: sourcesDigest() }, injectTo: "head" }],
};

// The built page goes into the Python package, which serves it and ships it in the wheel
export default defineConfig({
  base: "./",
  plugins: [marked],
  build: {
    outDir: "../lean_yaw_env/viewer/page",
    emptyOutDir: true,
    target: "es2022",
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 900,
  },
  worker: { format: "es" },
});
