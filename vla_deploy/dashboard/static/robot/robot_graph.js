/**
 * Build the robot's links as a tree of three.js objects that joints turn and shift.
 *
 * A link of the model is {name, parent, position_m, quaternion [x, y, z, w], joints, shapes}: each
 * joint {name, kind "hinge" | "slide", axis, follows?} moves the link from where it stands at zero.
 */

import { BoxGeometry, CapsuleGeometry, CylinderGeometry, Group, Mesh, MeshStandardMaterial, Quaternion, SphereGeometry, Vector3 } from "../vendor/three.js";

const SEGMENTS = 24;

// How a kind of shape of MJCF is made; its cylinders and capsules stand along z, three's along y.
const GEOMETRIES = {
  box: ([x, y, z]) => new BoxGeometry(2 * x, 2 * y, 2 * z),
  sphere: ([radius]) => new SphereGeometry(radius, SEGMENTS, SEGMENTS / 2),
  ellipsoid: ([x, y, z]) => new SphereGeometry(1, SEGMENTS, SEGMENTS / 2).scale(x, y, z),
  cylinder: ([radius, half]) => new CylinderGeometry(radius, radius, 2 * half, SEGMENTS).rotateX(Math.PI / 2),
  capsule: ([radius, half]) => new CapsuleGeometry(radius, 2 * half, SEGMENTS / 4, SEGMENTS).rotateX(Math.PI / 2),
};

/** Hold the tree, and move it by the values of joints. */
export class RobotGraph {
  #movers = [];
  #meshes = new Map();

  constructor(model, colours) {
    this.root = new Group();
    const links = new Map();
    for (const link of model.links) {
      const group = new Group();
      place(group, link);
      links.set(link.name, group);
      (links.get(link.parent) ?? this.root).add(group);
      for (const joint of link.joints ?? []) this.#addMover(group, joint);
      const meshes = (link.shapes ?? []).flatMap((shape) => meshOf(shape, colours) ?? []);
      group.add(...meshes);
      for (const joint of link.joints ?? []) this.#meshes.set(joint.follows ?? joint.name, [...(this.#meshes.get(joint.follows ?? joint.name) ?? []), ...meshes]);
    }
  }

  /** Set joints by name; those that are not named stay. */
  set(names, positions) {
    const values = new Map(names.map((name, at) => [name, positions[at]]));
    for (const mover of this.#movers) mover(values);
  }

  /** Paint what a joint moves in a colour, and everything else as it was. */
  mark(joint, colour) {
    for (const meshes of this.#meshes.values()) for (const mesh of meshes) mesh.material.emissive.set(0x000000);
    for (const mesh of this.#meshes.get(joint) ?? []) mesh.material.emissive.set(colour);
  }

  /** Give back what the graphics card holds. */
  dispose() {
    this.root.traverse((one) => {
      one.geometry?.dispose();
      one.material?.dispose();
    });
  }

  #addMover(group, { name, kind, axis, follows, factor = 1 }) {
    const along = new Vector3(...axis);
    const place_m = group.position.clone();
    const stand = group.quaternion.clone();
    const turn = new Quaternion();
    const shift = new Vector3();
    this.#movers.push((values) => {
      const value = values.get(follows ?? name);
      if (!Number.isFinite(value)) return;
      if (kind === "slide") {
        shift.copy(along).multiplyScalar(factor * value).applyQuaternion(stand);
        group.position.copy(place_m).add(shift);
      } else group.quaternion.copy(stand).multiply(turn.setFromAxisAngle(along, factor * value));
    });
  }
}

function meshOf(shape, colours) {
  const make = GEOMETRIES[shape.kind];
  if (!make) return null; // a mesh of triangles is not sent to browsers
  const rgba = shape.rgba ?? null;
  const material = new MeshStandardMaterial({ roughness: 0.65, metalness: 0.1 });
  if (rgba) material.color.setRGB(rgba[0], rgba[1], rgba[2], "srgb");
  else material.color.set(colours.part);
  const mesh = new Mesh(make(shape.size_m), material);
  place(mesh, shape);
  return mesh;
}

function place(object, { position_m = [0, 0, 0], quaternion = [0, 0, 0, 1] }) {
  object.position.set(...position_m);
  object.quaternion.set(...quaternion);
}
