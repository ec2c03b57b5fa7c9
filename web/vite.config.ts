import { defineConfig } from "vite";

// The built page goes into the Python package, which serves it and ships it in the wheel
export default defineConfig({
  base: "./",
  build: {
    outDir: "../lean_yaw_env/viewer/page",
    emptyOutDir: true,
    target: "es2022",
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 900,
  },
  worker: { format: "es" },
});
