// The rig as a drawing: rail with a scale in metres, cart, pole (angle 0 upright, counterclockwise positive), command.

import { roundStep, digitsOf } from "./axis.js";
import { cleared, line, palette } from "./canvas.js";
import { tick } from "./words.js";

const SCALE_BELOW = 30; // pixels from the scale to the lower edge
let fullCommand = 0.5; // of a full arrow: a PWM fraction, or the largest command yet of a rig in volts

// source, ghost: of a frame; ghost may be null. colour, ghostColour: names of the palette.
export function drawStage(canvas, railHalf, source, colour, ghost, ghostColour) {
  const sheet = cleared(canvas);
  if (!sheet) return;
  const { pen, width, height } = sheet;
  const perMetre = (width - 36) / (2 * railHalf * 1.14);
  const floor = height - SCALE_BELOW;
  const place = {
    pen, railHalf, perMetre, floor, rail: Math.round(floor / 2) + 2, middle: width / 2,
    pole: Math.min(floor / 2 - 22, 0.5 * railHalf * perMetre), width,
    cart: Math.max(30, Math.min(74, 0.16 * perMetre)),
  };
  drawRail(place);
  drawScale(place);
  if (ghost) drawGhost(place, ghost, palette()[ghostColour]);
  if (source) drawRig(place, source, palette()[colour]);
}

// A cart far beyond the rail stays in sight, at the edge.
function columnOf(place, source) {
  const reach = (place.width / 2 - place.cart / 2 - 4) / place.perMetre;
  return place.middle + Math.max(-reach, Math.min(reach, source.cart_m ?? 0)) * place.perMetre;
}

function drawRail({ pen, railHalf, perMetre, rail, middle }) {
  const colours = palette(), end = railHalf * perMetre;
  pen.strokeStyle = colours.rail;
  pen.lineWidth = 5;
  line(pen, middle - end, rail, middle + end, rail);
  pen.fillStyle = colours["rail-edge"];
  for (const side of [-1, 1]) {
    pen.beginPath();
    pen.roundRect(middle + side * (end + 3) - 3, rail - 13, 6, 26, 2);
    pen.fill();
  }
}

function drawScale({ pen, railHalf, perMetre, floor, middle }) {
  const colours = palette();
  const step = roundStep(58 / perMetre, false), fine = step / 5, digits = digitsOf(step);
  const count = Math.floor(railHalf / fine + 1e-6);
  pen.strokeStyle = colours.axis;
  pen.fillStyle = colours.soft;
  pen.lineWidth = 1;
  pen.textBaseline = "top";
  pen.textAlign = "center";
  const row = Math.round(floor) + 0.5;
  line(pen, middle - railHalf * perMetre, row, middle + railHalf * perMetre, row);
  for (let k = -count; k <= count; k += 1) {
    const column = Math.round(middle + k * fine * perMetre) + 0.5, labelled = k % 5 === 0;
    line(pen, column, row, column, row + (labelled ? 7 : 4));
    if (labelled) pen.fillText(k === 0 ? "0 m" : tick(k * fine, digits), column, row + 11);
  }
}

function tipOf(place, column, source) {
  return [column - place.pole * Math.sin(source.pole_rad), place.rail - place.pole * Math.cos(source.pole_rad)];
}

function drawGhost(place, source, colour) {
  const { pen, rail, cart } = place, column = columnOf(place, source);
  pen.save();
  pen.strokeStyle = colour;
  pen.lineWidth = 1.5;
  pen.setLineDash([4, 3]);
  pen.beginPath();
  pen.roundRect(column - cart / 2 - 2, rail - cart * 0.26 - 2, cart + 4, cart * 0.52 + 4, 6);
  pen.stroke();
  if (source.pole_rad !== null) {
    const [tipX, tipY] = tipOf(place, column, source);
    line(pen, column, rail, tipX, tipY);
    pen.beginPath();
    pen.arc(tipX, tipY, 9, 0, 2 * Math.PI);
    pen.stroke();
  }
  pen.restore();
}

function drawRig(place, source, colour) {
  const { pen, rail, cart, floor } = place, colours = palette(), column = columnOf(place, source);
  pen.fillStyle = colour;
  pen.beginPath(); // where the cart is, on the scale
  pen.moveTo(column, floor);
  pen.lineTo(column - 5, floor - 9);
  pen.lineTo(column + 5, floor - 9);
  pen.fill();
  pen.beginPath();
  pen.roundRect(column - cart / 2, rail - cart * 0.26, cart, cart * 0.52, 5);
  pen.fill();
  if (source.cart_m === null) drawClamp(place, column);
  if (source.applied_pwm !== null) drawPush(place, column, source.applied_pwm);
  if (source.pole_rad === null) return;
  const [tipX, tipY] = tipOf(place, column, source);
  drawAngle(place, column, source.pole_rad);
  pen.strokeStyle = colours.well;
  pen.lineWidth = 9;
  line(pen, column, rail, tipX, tipY);
  pen.strokeStyle = colours.ink;
  pen.lineWidth = 5;
  line(pen, column, rail, tipX, tipY);
  for (const [x, y, radius, fill] of [[tipX, tipY, 7, colour], [column, rail, 4.5, colours.well]]) {
    pen.fillStyle = fill;
    pen.strokeStyle = colours.ink;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.fill();
    pen.stroke();
  }
}

// The angle from upright, and upright itself.
function drawAngle({ pen, rail, pole }, column, angle) {
  const colours = palette(), turn = Math.atan2(Math.sin(angle), Math.cos(angle));
  pen.save();
  pen.strokeStyle = colours.axis;
  pen.lineWidth = 1;
  pen.setLineDash([3, 4]);
  line(pen, column, rail - pole, column, rail);
  pen.setLineDash([]);
  pen.beginPath();
  pen.arc(column, rail, pole * 0.55, -Math.PI / 2, -Math.PI / 2 - turn, turn > 0);
  pen.stroke();
  pen.restore();
}

// What is applied, as an arrow from the cart's side.
function drawPush({ pen, rail, cart }, column, command) {
  fullCommand = Math.max(fullCommand, Math.abs(command));
  const way = Math.sign(command), long = Math.abs(command) / fullCommand * 64;
  if (long < 1) return;
  const from = column + way * (cart / 2 + 4), to = from + way * (long + 7);
  pen.strokeStyle = pen.fillStyle = palette().ink;
  pen.lineWidth = 3;
  line(pen, from, rail, to - way * 7, rail);
  pen.beginPath();
  pen.moveTo(to, rail);
  pen.lineTo(to - way * 8, rail - 6);
  pen.lineTo(to - way * 8, rail + 6);
  pen.fill();
}

// A rig without a cart's position: its cart is locked.
function drawClamp({ pen, rail, cart }, column) {
  pen.strokeStyle = palette().well;
  pen.lineWidth = 1.5;
  for (const side of [-0.3, 0, 0.3]) {
    line(pen, column + (side - 0.08) * cart, rail + cart * 0.16, column + (side + 0.08) * cart, rail - cart * 0.16);
  }
}
