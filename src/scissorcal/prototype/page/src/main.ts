import { readScene } from "./scene";

const text = document.getElementById("scene")?.textContent ?? "";
const page = document.getElementById("page") as HTMLElement;
page.textContent = readScene(text).name;
