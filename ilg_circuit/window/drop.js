// Files may be dropped anywhere on the window: they go to its field for files, and never replace the page.
(() => {
  const field = (root) => {
    for (const node of root.querySelectorAll("*")) {
      if (node.matches("input[type=file]")) return node;
      const inner = node.shadowRoot && field(node.shadowRoot);
      if (inner) return inner;
    }
    return null;
  };
  const carried = (event) => event.dataTransfer && [...event.dataTransfer.types].includes("Files");
  const lit = (on) => document.body.classList.toggle("dropping", on);
  document.addEventListener("dragover", (event) => { if (carried(event)) { event.preventDefault(); lit(true); } });
  document.addEventListener("dragleave", (event) => { if (!event.relatedTarget) lit(false); });
  document.addEventListener("drop", (event) => {
    lit(false);
    if (!carried(event) || !event.dataTransfer.files.length) return;
    event.preventDefault();
    const input = field(document);
    if (!input) return;
    input.files = event.dataTransfer.files;
    input.dispatchEvent(new Event("change", { bubbles: true }));
  });
})();
