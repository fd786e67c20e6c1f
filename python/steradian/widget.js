// Shows a render while it goes on: an image, a line of text, a bar and a button. All it knows comes from the model.

function render({ model, el }) {
  const make = (tag, name, parent) => {
    const node = document.createElement(tag);
    node.className = `steradian-${name}`;
    parent.append(node);
    return node;
  };
  const box = make("div", "live", el);
  const image = make("img", "image", box);
  image.alt = "the render so far";
  const line = make("div", "line", box);
  const button = make("button", "stop", line);
  button.type = "button";
  button.textContent = "Stop";
  button.title = "End the render with what there is";
  const bar = make("progress", "bar", line);
  bar.max = 1;
  const error = make("span", "error", line);
  const text = make("span", "text", line);

  let shown = null;
  const showImage = () => {
    const png = model.get("png");
    if (!png || png.byteLength === 0) return;
    const url = URL.createObjectURL(new Blob([png], { type: "image/png" }));
    image.onload = () => {
      if (shown) URL.revokeObjectURL(shown);
      shown = url;
    };
    image.src = url;
    const [width, height] = model.get("size");
    image.width = width;
    image.height = height;
  };
  const showState = () => {
    const running = model.get("running");
    bar.value = model.get("fraction");
    error.textContent = model.get("error");
    text.textContent = model.get("text");
    button.disabled = !running || model.get("stop_wanted");
    button.textContent = running && model.get("stop_wanted") ? "Stopping" : "Stop";
    box.classList.toggle("steradian-over", !running);
  };
  const stop = () => {
    model.set("stop_wanted", true);
    model.save_changes();
    showState();
  };

  button.addEventListener("click", stop);
  model.on("change:png", showImage);
  const state = ["fraction", "error", "text", "running", "stop_wanted"].map((name) => `change:${name}`);
  state.forEach((event) => model.on(event, showState));
  showImage();
  showState();
  return () => {
    model.off("change:png", showImage);
    state.forEach((event) => model.off(event, showState));
    if (shown) URL.revokeObjectURL(shown);
  };
}

export default { render };
