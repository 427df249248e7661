// @ts-check
/** @import {Place, State} from "./messages.js" */
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { colourOf, inkOn } from "./palette.js";

/** Farm-ar's plane in three.js, whose z points to the player. @param {number} x @param {number} y @param {number} z */
export const at = (x, y, z) => new THREE.Vector3(x, y, -z);

/** The turn of a model whose front is +z. @param {number} yaw */
const turned = (yaw) => Math.PI - yaw;

const LIFTED_M = 0.05;
/** The diagonal of the farm's table, for which signs and lights are made. */
const FARM_M = Math.hypot(1.2, 0.8);

/** How large a room is beside the farm. @param {Place} place */
export const scaleOf = ({ width, depth }) => Math.hypot(width, depth) / FARM_M;

const loader = new GLTFLoader();

/** @param {string} name @returns {Promise<THREE.Group>} */
async function load(name) {
  const { scene } = await loader.loadAsync(`models/${name}.glb`);
  scene.traverse((node) => {
    if (!(node instanceof THREE.Mesh)) return;
    node.castShadow = node.receiveShadow = true;
    // Where a file says nothing of metal, glTF means metal, which is black without surroundings to mirror.
    Object.assign(node.material, { metalness: 0, roughness: 0.9 });
  });
  return scene;
}

/**
 * A copy of a model stretched to a size, its foot's middle at the origin; what is not its body may stick out.
 *
 * @param {THREE.Group} model @param {[number, number, number]} size width, height, depth
 */
function fitted(model, [width, height, depth]) {
  const copy = model.clone(true);
  const body = copy.getObjectByName("body") ?? copy;
  const box = new THREE.Box3().setFromObject(body);
  const extent = box.getSize(new THREE.Vector3());
  const middle = box.getCenter(new THREE.Vector3());
  const scale = new THREE.Vector3(width / extent.x, height / extent.y, depth / extent.z);
  copy.position.set(-middle.x * scale.x, -box.min.y * scale.y, -middle.z * scale.z);
  copy.scale.copy(scale);
  return new THREE.Group().add(copy);
}

/**
 * A plate with a label's name, or a number. Its shape tells coops from hutches where colours do not.
 *
 * @param {string} label @param {boolean} square
 */
function plate(label, square) {
  const canvas = document.createElement("canvas");
  const wide = label.length > 2 ? 256 : 112;
  canvas.width = wide;
  canvas.height = 96;
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = THREE.SRGBColorSpace;
  const material = new THREE.SpriteMaterial({ map, depthTest: false });
  const sprite = new THREE.Sprite(material);
  sprite.scale.set((0.14 * wide) / 256, 0.0525, 1);
  sprite.center.set(0.5, 0);
  sprite.renderOrder = 2;
  /** @param {boolean} wrong */
  const draw = (wrong) => {
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    const colour = colourOf(label);
    pen.clearRect(0, 0, wide, 96);
    pen.beginPath();
    pen.roundRect(8, 8, wide - 16, 80, square ? 6 : 40);
    pen.fillStyle = colour;
    pen.fill();
    pen.lineWidth = wrong ? 12 : 4;
    pen.strokeStyle = wrong ? "#b00020" : "#222";
    pen.stroke();
    pen.fillStyle = inkOn(colour);
    pen.font = `bold ${wide < 256 ? 60 : 44}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillText(wrong ? `✗ ${label.split("-")[0]}` : label.split("-")[0], wide / 2, 50, wide - 36);
    map.needsUpdate = true;
  };
  draw(false);
  let shown = false;
  return {
    sprite,
    /** @param {boolean} wrong */
    mark(wrong) {
      if (wrong !== shown) draw((shown = wrong));
    },
  };
}

/** Everything that stands on the table, as three.js draws it. */
export class Table {
  /** @param {Place} hello */
  constructor(hello) {
    this.hello = hello;
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color("#dfe6e4");
    this.scale = scaleOf(hello);
    /** @type {THREE.Object3D[]} */ this.things = [];
    /** @type {ReturnType<typeof plate>[]} */ this.plates = [];
    /** @type {THREE.Object3D[]} */ this.animals = [];
    /** @type {{chicken?: THREE.Group, bunny?: THREE.Group, open?: THREE.Group, closed?: THREE.Group}} */
    this.models = {};
    /** @type {Map<string, THREE.Object3D>} */ this.dressedModels = new Map();
    /** @type {ReturnType<typeof plate>[]} */ this.numbers = [];
    /** @type {THREE.Object3D[] | null} */ this.homes = null;
    this.addRoom();
    this.view = this.addView();
  }

  addRoom() {
    const { width, depth } = this.hello;
    this.scene.add(new THREE.HemisphereLight("#ffffff", "#8c8474", 1.6));
    const sun = new THREE.DirectionalLight("#fff4e0", 2.2);
    sun.position.copy(at(width * 0.2, 1.6 * this.scale, depth * 0.9));
    sun.target.position.copy(at(width / 2, 0, depth / 2));
    sun.castShadow = true;
    sun.shadow.mapSize.set(1024, 1024);
    sun.shadow.camera.left = sun.shadow.camera.bottom = -width;
    sun.shadow.camera.right = sun.shadow.camera.top = width;
    sun.shadow.camera.near = 0.2;
    sun.shadow.camera.far = 4 * this.scale;
    sun.shadow.bias = -0.002;
    this.scene.add(sun, sun.target);
    const top = new THREE.Mesh(
      new THREE.BoxGeometry(width, 0.03, depth),
      new THREE.MeshStandardMaterial({ color: "#9fc27e", roughness: 0.9 }),
    );
    top.position.copy(at(width / 2, -0.015, depth / 2));
    top.receiveShadow = true;
    const rim = new THREE.Mesh(
      new THREE.BoxGeometry(width + 0.06, 0.05, depth + 0.06),
      new THREE.MeshStandardMaterial({ color: "#8a6b4a" }),
    );
    rim.position.copy(at(width / 2, -0.03, depth / 2));
    this.scene.add(rim, top);
  }

  /** The part of the table that the headset sees, drawn on it. */
  addView() {
    const geometry = new THREE.BufferGeometry();
    const line = new THREE.LineLoop(geometry, new THREE.LineBasicMaterial({ color: "#c2347e" }));
    line.renderOrder = 1;
    line.frustumCulled = false; // its bounds change with every visit
    this.scene.add(line);
    return line;
  }

  /** Fetch the models and put everything up. */
  async furnish() {
    const names = [...new Set(this.hello.objects.map((thing) => thing.category))];
    const known = new Map(
      await Promise.all(
        names.map(async (name) => {
          try {
            return /** @type {[string, THREE.Group]} */ ([name, await load(name)]);
          } catch {
            return /** @type {[string, THREE.Group]} */ ([name, block()]);
          }
        }),
      ),
    );
    for (const thing of this.hello.objects) {
      const object = fitted(/** @type {THREE.Group} */ (known.get(thing.category)), thing.size);
      this.things.push(object);
      const name = plate(thing.label, thing.category === "coop");
      name.sprite.scale.multiplyScalar(this.scale);
      name.sprite.visible = !thing.fixed;
      this.plates.push(name);
      this.scene.add(object, name.sprite);
    }
    const [chicken, bunny, open, closed] = await Promise.all(
      ["chicken", "bunny", "hand-open", "hand-closed"].map(load),
    );
    this.models = { chicken, bunny, open, closed };
    this.hands = new THREE.Group().add(open, closed);
    this.hands.scale.setScalar(this.scale);
    this.scene.add(this.hands);
  }

  /**
   * Show a moment.
   *
   * @param {State} state
   * @param {{wrong: number[], numbered: number[] | null, home: [number, number, number][] | null}} shown labels that
   *   are marked as wrong; buildings with numbers in place of labels; where buildings belong
   */
  show(state, shown) {
    if (!this.hands) return;
    const { objects } = this.hello;
    const held = state.hand ? state.hand[3] : null;
    const wrong = new Set(shown.wrong);
    objects.forEach((thing, i) => {
      const [x, z, yaw] = state.objects[i];
      this.things[i].position.copy(at(x, i === held ? LIFTED_M * this.scale : 0, z));
      this.things[i].rotation.y = turned(yaw);
      const [bx, bz] = state.believed[i];
      this.plates[i].sprite.position.copy(at(bx, thing.size[1] + 0.02, bz));
      this.plates[i].mark(wrong.has(i));
      this.plates[i].sprite.visible = !thing.fixed && shown.numbered === null;
    });
    this.showNumbers(state, shown.numbered ?? []);
    if (shown.home && !this.homes) this.homes = this.addHomes(shown.home);
    this.showAnimals(state.animals);
    this.showHand(state);
    this.showView(state.camera);
  }

  /** @param {State} state @param {number[]} numbered buildings in the order of their numbers */
  showNumbers(state, numbered) {
    while (this.numbers.length < numbered.length) {
      const one = plate(String(this.numbers.length + 1), true);
      this.numbers.push(one);
      this.scene.add(one.sprite);
    }
    this.numbers.forEach(({ sprite }, k) => {
      sprite.visible = k < numbered.length;
      if (!sprite.visible) return;
      const [x, z] = state.objects[numbered[k]];
      sprite.position.copy(at(x, this.hello.objects[numbered[k]].size[1] + 0.02, z));
    });
  }

  /** Coloured places on the table where buildings belong. @param {[number, number, number][]} home */
  addHomes(home) {
    return this.hello.objects.flatMap((thing, i) => {
      if (thing.fixed) return [];
      const [x, z, yaw] = home[i];
      const place = new THREE.Mesh(
        new THREE.BoxGeometry(thing.size[0], 0.002, thing.size[2]),
        new THREE.MeshBasicMaterial({ color: colourOf(thing.label) }),
      );
      place.position.copy(at(x, 0.001, z));
      place.rotation.y = turned(yaw);
      this.scene.add(place);
      return [place];
    });
  }

  /** @param {State["animals"]} animals */
  showAnimals(animals) {
    while (this.animals.length < animals.length) {
      const animal = new THREE.Group();
      animal.scale.setScalar(this.scale);
      this.animals.push(animal);
      this.scene.add(animal);
    }
    this.animals.forEach((animal, k) => {
      animal.visible = k < animals.length;
      if (!animal.visible) return;
      const [x, z, heading, goal] = animals[k];
      const kind = this.hello.objects[goal]?.category === "hutch" ? "bunny" : "chicken";
      if (animal.userData.goal !== goal) {
        animal.clear();
        animal.add(this.dressed(kind, this.hello.objects[goal].label));
        animal.userData.goal = goal;
      }
      animal.position.copy(at(x, 0, z));
      animal.rotation.y = turned(heading);
    });
  }

  /** An animal in the colour of the label it runs to. @param {"chicken" | "bunny"} kind @param {string} label */
  dressed(kind, label) {
    let model = this.dressedModels.get(label);
    if (!model) {
      model = /** @type {THREE.Group} */ (this.models[kind]).clone(true);
      const ring = new THREE.Mesh(
        new THREE.CircleGeometry(0.014, kind === "chicken" ? 4 : 16),
        new THREE.MeshBasicMaterial({ color: colourOf(label) }),
      );
      ring.rotation.x = -Math.PI / 2;
      ring.position.y = 0.001;
      model.add(ring);
      this.dressedModels.set(label, model);
    }
    return model.clone(true);
  }

  /** @param {State} state */
  showHand(state) {
    const hands = /** @type {THREE.Group} */ (this.hands);
    const { hand } = state;
    hands.visible = hand !== null && hand[1] > -0.45;
    if (!hand) return;
    const [x, z, yaw, held] = hand;
    hands.position.copy(at(x, (held === null ? 0.1 : 0.09 + LIFTED_M) * this.scale, z));
    hands.rotation.y = turned(yaw);
    hands.children[0].visible = held === null;
    hands.children[1].visible = held !== null;
  }

  /** @param {State["camera"]} camera */
  showView(camera) {
    const { width, depth } = this.hello;
    const points = [[camera.x, camera.z]];
    for (let k = 0; k <= 12; k++) {
      const angle = camera.yaw - camera.left + ((camera.left + camera.right) * k) / 12;
      const reach = Math.min(camera.range, width + depth);
      points.push([camera.x + reach * Math.sin(angle), camera.z + reach * Math.cos(angle)]);
    }
    this.view.geometry.setFromPoints(points.map(([x, z]) => at(x, 0.002, z)));
  }
}

/** What stands for a category without a model. */
function block() {
  const mesh = new THREE.Mesh(
    new THREE.BoxGeometry(1, 1, 1),
    new THREE.MeshStandardMaterial({ color: "#c9b08a" }),
  );
  mesh.name = "body";
  return new THREE.Group().add(mesh);
}
