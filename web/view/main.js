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
  const subject = await loadSubject(readScene());
  const cells = contents.balls.length ? ballCells(contents, subject, settings) : [sceneCell(subject, settings)];
  if (contents.measurement) {
    cells.push(measuredCell(contents.measurement, settings));
    settings.change({environment: {name: 'none', turn: 0}});
  }
  const stage = new Stage(find('canvas'), settings, cells);
  find('.cells').append(...cells.map(({frame}) => frame));
  fillPage(contents, settings, subject, stage);
  stage.frame(radiusOf(cells), contents.balls.length ? [0, 0, 1] : [0.45, 0.35, 1]);
  return {settings, stage, subject};
}

/** A scene, its middle in the origin. */
function sceneCell(subject, settings) {
  const {center} = boundsOf(subject.root);
  const object = new Group().add(subject.root);
  object.position.copy(center).negate();
  return new Cell({title: '', note: '', object, looks: ['exact', 'gltf'], show: look => subject.show(look), settings});
}

/** A cell for each ball, which are the scene's roots. */
function ballCells({balls}, subject, settings) {
  return balls.map(({title, note, node}) => {
    const object = subject.root.getObjectByName(node);
    return new Cell({title, note, object, looks: ['exact', 'gltf'], show: look => subject.show(look), settings});
  });
}

function measuredCell({title, note, size}, settings) {
  const object = measuredBall(readMeasurement(), size);
  const show = (_, sun) => {
    object.material.uniforms.toSun.value.set(...sun.toSun);
    object.material.uniforms.irradiance.value = sun.irradiance;
  };
  return new Cell({title, note, object, looks: ['measured'], show, settings});
}

const radiusOf = cells => Math.max(...cells.map(({object}) => boundsOf(object).radius)) || 1;

function fillPage({title, note, about, measurement}, settings, subject, stage) {
  find('h1').textContent = title;
  find('header p').textContent = note;
  find('.stage').classList.toggle('single', stage.cells.length === 1);
  const pictures = picturesOf(measurement);
  fillBar(find('.bar'), settings, pictures);
  const openPanorama = panoramaInput((buffer, name) => takePanorama(stage, settings, buffer, name));
  fillPanel(find('.panel'), {settings, slots: subject.slots, openPanorama, about});
  dragLight(find('.stage'), find('canvas'), settings);
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
  say(`This browser cannot draw the page: ${error.message}. It needs WebGL 2.`);
  console.error(error);
});
