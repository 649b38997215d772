// The page: a package's law under one's own hand, beside what was measured.

import { App } from "./app";
import { bytesOf, readScene } from "./scene";
import { Server } from "./socket";

const text = (id: string): string => document.getElementById(id)?.textContent ?? "";

async function begin(): Promise<void> {
  const page = document.getElementById("page") as HTMLElement;
  try {
    const scene = readScene(text("scene"));
    const server = JSON.parse(text("server") || "null") as Server | null;
    const app = new App(page, scene, await WebAssembly.compile(bytesOf(text("kernel"))), server);
    Object.assign(window, { scissorcal: app });
    app.run();
  } catch (error) {
    page.textContent = `The page cannot be shown: ${(error as Error).message}`;
    throw error;
  }
}

void begin();
