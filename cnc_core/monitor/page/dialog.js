// A dialog of the program: the operator answers it here, as at the terminal.

import { byId, element, setText } from "./format.js";

export class Dialog {
  /** `act`: gives an order and answers with what the CNC says. */
  constructor(act) {
    this.act = act;
    this.number = 0;
    this.inputs = new Map();
    byId("dialog-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.answer(event.submitter ? event.submitter.value : "");
    });
  }

  /** One frame: the dialog that is open, or null. */
  take(dialog) {
    const box = byId("dialog");
    if (!dialog) {
      if (!box.hidden) { box.hidden = true; this.number = 0; }
      return;
    }
    if (dialog.number === this.number) return;
    this.number = dialog.number;
    const who = dialog.channel ? `The program of ${dialog.channel} asks` : "The program asks";
    setText(byId("dialog-head"), dialog.title ? `${who}: ${dialog.title}` : who);
    setText(byId("dialog-text"), dialog.text);
    setText(byId("dialog-problem"), "");
    this.inputs.clear();
    byId("dialog-inputs").replaceChildren(...Object.entries(dialog.inputs).map(([name, value]) => this.input(name, value)));
    const names = dialog.buttons.length ? dialog.buttons : [""];
    byId("dialog-buttons").replaceChildren(...names.map((name) => (
      element("button", name || "Enter", { value: name, type: "submit" }))));
    box.hidden = false;
    box.focus();
  }

  input(name, value) {
    const row = element("p");
    const input = element("input", "", { type: "number", step: "any", value, id: `dialog-input-${name}`, required: "" });
    row.append(element("label", name, { for: input.id }), " ", input);
    this.inputs.set(name, [input, value]);
    return row;
  }

  async answer(press) {
    const set = {};
    for (const [name, [input, before]] of this.inputs) {
      const value = Number(input.value);
      if (value !== before) set[name] = value;
    }
    try {
      await this.act({ do: "answer", number: this.number, set, press });
      byId("dialog").hidden = true;
    } catch (error) {
      setText(byId("dialog-problem"), error.message);
    }
  }
}
