// A page that sgdbake wrote: a scene, or balls, drawn exactly and as glTF.

import {Group} from 'three';
import {fillBar, picturesOf} from './bar.js';
import {Cell} from './cells.js';
import {dragLight} from './drag.js';
import {readContents, readMeasurement, readScene} from './embedded.js';
import {listenToKeys} from './keys.js';
import {measuredBall} from './measured.js';
import {panoramaInput} from './panoramas.js';
import {fillPanel} from './panel.js';
import {Settings} from './settings.js';
import {Stage} from './stage.js';
import {boundsOf, loadSubject} from './subject.js';

const find = selector => document.querySelector(selector);

async function open() {
  const contents = readContents();
  const settings = new Settings();
  const balls = shownBalls(contents.balls);
  const subject = await loadSubject(readScene(), balls && balls.map(({root}) => root));
  const cells = balls ? ballCells(balls, subject, settings) : [sceneCell(subject, settings)];
  if (contents.measurement) {
    cells.push(measuredCell(contents.measurement, settings));
    settings.change({environment: {name: 'none', turn: 0}});
  }
  find('.cells').append(...cells.map(({frame}) => frame));
  const stage = new Stage(find('canvas'), settings, cells, balls ? aroundBalls : () => ({top: 0, bottom: 0}));
  const title = balls && balls.length < contents.balls.length ? bare(balls[0].title) : contents.title;
  fillPage({...contents, title}, settings, balls ? ballSlots(contents.balls, balls, subject) : subject.slots, stage);
  stage.frame(radiusOf(cells), balls ? [0, 0, 1] : [0.45, 0.35, 1]);
  return {settings, stage, subject};
}

/** A scene, its middle in the origin. */
function sceneCell(subject, settings) {
  const {center} = boundsOf(subject.root);
  const object = new Group().add(subject.root);
  object.position.copy(center).negate();
  return new Cell({title: '', note: '', surface: null, object, looks: ['exact', 'gltf'], show: look => subject.show(look), settings});
}

/** The balls to draw, each with the number of its root node; null where the scene is another one. */
function shownBalls(balls) {
  if (!balls.length) return null;
  const numbered = balls.map((ball, root) => ({...ball, root}));
  const wanted = named() || (balls.length > MOST_BALLS ? balls[0].title : '');
  const chosen = numbered.filter(({title}) => bare(title) === bare(wanted));
  return chosen.length ? chosen : numbered;
}

/** The material that the page's address names. */
function named() {
  const name = location.hash.slice(1);
  try {
    return decodeURIComponent(name);
  } catch {
    return name;
  }
}

/** Of more balls than these only one material's are drawn. */
const MOST_BALLS = 12;

/** A material's name without its edition. */
const bare = name => name.replace(/@refit$/, '');

/** A cell for each ball. */
function ballCells(balls, subject, settings) {
  return balls.map(({title, note, surface}, k) => {
    const object = subject.roots[k];
    return new Cell({title, note, surface, object, looks: ['exact', 'gltf'], show: look => subject.show(look), settings});
  });
}

/** The slots of the balls that are drawn, then the others, which open when chosen. */
function ballSlots(all, drawn, subject) {
  const slots = drawn.map(({note, root}) => ({...subject.slots[root], note}));
  const others = all.filter((_, root) => !drawn.some(ball => ball.root === root));
  const open = title => () => { location.hash = encodeURIComponent(title); };
  return [...slots, ...others.map(({title, note}) => ({name: title, note, open: open(title)}))];
}

/** Pixels that the header and the bar take. */
function aroundBalls() {
  const [stage, header, bar] = ['.stage', 'header', '.bar'].map(name => find(name).getBoundingClientRect());
  return {top: header.bottom - stage.top + 12, bottom: stage.bottom - bar.top + 12};
}

function measuredCell({title, note, size}, settings) {
  const object = measuredBall(readMeasurement(), size);
  const show = (_, sun) => {
    object.material.uniforms.toSun.value.set(...sun.toSun);
    object.material.uniforms.irradiance.value = sun.irradiance;
  };
  return new Cell({title, note, surface: null, object, looks: ['measured'], show, settings});
}

const radiusOf = cells => Math.max(...cells.map(({object}) => boundsOf(object).radius)) || 1;

function fillPage({title, note, about, measurement}, settings, slots, stage) {
  find('h1').textContent = title;
  find('header p').textContent = `${note}. Drag to turn, pinch or scroll to zoom.`;
  find('.stage').classList.toggle('single', stage.cells.length === 1);
  const pictures = picturesOf(measurement);
  fillBar(find('.bar'), settings, pictures);
  const openPanorama = panoramaInput((buffer, name) => takePanorama(stage, settings, buffer, name));
  fillPanel(find('.panel'), {settings, slots, openPanorama, about});
  dragLight(find('.stage'), find('canvas'), settings);
  settings.follow(({picture}) => find('.stage').classList.toggle('differs', picture !== 'split'));
  addEventListener('hashchange', () => location.reload());
  listenToKeys(settings, pictures.map(([picture]) => picture), () => stage.reset());
}

function takePanorama(stage, settings, buffer, name) {
  try {
    stage.lights.take(buffer);
    say('');
    settings.changeEnvironment({name: 'file', turn: 0});
  } catch (error) {
    settings.change({});
    say(`${name} cannot be read as a panorama (${error.message}). Use an equirectangular Radiance .hdr file.`);
  }
}

function say(text) {
  find('.message').textContent = text;
}

open().then(view => {
  say('');
  globalThis.view = view;
}, error => {
  say(`The page cannot be drawn: ${error.message}. It needs a browser with WebGL 2.`);
  console.error(error);
});
