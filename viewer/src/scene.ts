// One 3-D view: an object in its own frame O, a hand at it, and what explains both. Registers itself as the module "scene".
import * as THREE from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { GLTFExporter } from 'three/examples/jsm/exporters/GLTFExporter.js';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import { ballByHops, linksOf, type Links } from './ball';
import { lookUp, noValue, rangeOf, shareOf, type MapName } from './colours';
import { jointPose, keyAt, mix, poseAt, type HandModel } from './kinematics';
import type { Candidate, Motion } from './data';

export interface Field { name: string; title: string; unit: string; values: Float32Array }
export interface Probe { vertex: number; fields: { name: string; title: string; value: number }[] }
export interface BallShown { vertices: number }
export type Parts = 'hand' | 'cloud' | 'voxels' | 'candidates' | 'contacts' | 'edges';

const toVector = (p: number[]) => new THREE.Vector3(p[0], p[1], p[2]);
const linear = (rgb: number[]) => new THREE.Color().setRGB(rgb[0], rgb[1], rgb[2], THREE.SRGBColorSpace);

export class View {
  readonly canvas: HTMLCanvasElement;
  fields: Field[] = [];
  hand: HandModel | null = null;
  onProbe: (probe: Probe | null) => void = () => {};
  onCamera: () => void = () => {};
  onCandidate: (index: number) => void = () => {};

  private renderer: THREE.WebGLRenderer;
  private scene = new THREE.Scene();
  private camera = new THREE.PerspectiveCamera(35, 1, 0.005, 20);
  private controls: OrbitControls;
  private world = new THREE.Group();
  private objectGroup = new THREE.Group();
  private handGroup = new THREE.Group();
  private links: THREE.Object3D[] = [];
  private surface: THREE.Mesh | null = null;
  private inside: THREE.Mesh | null = null;
  private edges: THREE.LineSegments | null = null;
  private cloud: THREE.Object3D | null = null;
  private voxels: THREE.Object3D | null = null;
  private candidates = new THREE.Group();
  private contacts = new THREE.Group();
  private ball = new THREE.Group();
  private ballVertices: Set<number> | null = null;
  private links_: Links | null = null;
  private radius = 0;
  private hop = 0;
  private plane = new THREE.Plane(new THREE.Vector3(1, 0, 0), 0);
  private sectionOn = false;
  private pending = false;
  private coloured: { field: string; map: MapName } = { field: '', map: 'dusk' };
  private disposed = false;

  constructor(private host: HTMLElement, up: [number, number, number], label: string) {
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.renderer.localClippingEnabled = true;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.canvas = this.renderer.domElement;
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute('role', 'img');
    this.canvas.setAttribute('aria-label', label);
    host.append(this.canvas);
    this.camera.up.set(...up).normalize();
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8d939c, 1.7));
    const lamp = new THREE.DirectionalLight(0xffffff, 1.7);
    lamp.position.set(0.4, 0.6, 1);
    this.camera.add(lamp);
    this.scene.add(this.camera, this.world);
    this.world.add(this.objectGroup, this.handGroup);
    this.objectGroup.add(this.candidates, this.contacts, this.ball);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener('change', () => {
      this.draw();
      this.onCamera();
    });
    new ResizeObserver(() => this.fit()).observe(host);
    this.canvas.addEventListener('keydown', (event) => this.key(event));
    let down = [0, 0];
    this.canvas.addEventListener('pointerdown', (event) => (down = [event.clientX, event.clientY]));
    this.canvas.addEventListener('pointerup', (event) => {
      if (Math.hypot(event.clientX - down[0], event.clientY - down[1]) < 4) this.pick(event);
    });
    this.fit();
  }

  dispose(): void {
    this.disposed = true;
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.canvas.remove();
  }

  private fit(): void {
    const width = this.host.clientWidth || 300, height = this.host.clientHeight || 240;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  draw(): void {
    if (this.pending || this.disposed) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      if (!this.disposed) this.renderer.render(this.scene, this.camera);
    });
  }

  // ---- object ----

  async setObject(glb: ArrayBuffer): Promise<void> {
    const file = await new GLTFLoader().parseAsync(glb, '');
    file.scene.updateMatrixWorld(true);
    file.scene.traverse((node) => {
      const kind = node.userData.kind ?? node.parent?.userData.kind;
      if (node.userData.kind === 'object') {
        this.radius = node.userData.radius_m;
        this.hop = node.userData.hop_m;
      }
      if (node instanceof THREE.Points) {
        const places = this.places(node);
        if (kind === 'occupancy') this.voxels = this.boxes(places, node.parent?.userData.side_m ?? node.userData.side_m);
        else this.cloud = this.dots(places);
      } else if (node instanceof THREE.Mesh) {
        this.takeSurface(node);
      }
    });
    for (const part of [this.cloud, this.voxels]) if (part) this.objectGroup.add(part);
    this.show('cloud', false);
    this.show('voxels', false);
    this.look();
  }

  /** Positions in O: whole numbers in the file, scaled by its nodes. */
  private places(node: THREE.Mesh | THREE.Points): Float32Array {
    const from = node.geometry.getAttribute('position'), to = new Float32Array(3 * from.count), p = new THREE.Vector3();
    for (let i = 0; i < from.count; ++i) p.fromBufferAttribute(from, i).applyMatrix4(node.matrixWorld).toArray(to, 3 * i);
    return to;
  }

  private takeSurface(node: THREE.Mesh): void {
    const geometry = new THREE.BufferGeometry();
    const positions = this.places(node), count = positions.length / 3;
    geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
    geometry.setIndex(node.geometry.index);
    geometry.computeVertexNormals();
    geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(3 * count).fill(0.5), 3));
    const told = (node.geometry.userData.fields ?? node.userData.fields ?? []) as
      { attribute: string; name: string; title: string; unit: string; low: number; high: number }[];
    for (const field of told) {
      const codes = node.geometry.getAttribute(field.attribute.toLowerCase());
      if (!codes) continue;
      const values = new Float32Array(count);
      for (let i = 0; i < count; ++i) {
        const code = codes.getX(i);
        values[i] = code === 65535 ? NaN : field.low + ((field.high - field.low) * code) / 65534;
      }
      this.fields.push({ name: field.name, title: field.title, unit: field.unit, values });
    }
    const paint = new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.75, metalness: 0, clippingPlanes: [] });
    this.surface = new THREE.Mesh(geometry, paint);
    // What a cut opens: the inner side in one flat colour reads as solid.
    this.inside = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color: 0xb8873a, side: THREE.BackSide, clippingPlanes: [] }));
    this.objectGroup.add(this.surface, this.inside);
  }

  private dots(places: Float32Array): THREE.Points {
    const geometry = new THREE.BufferGeometry().setAttribute('position', new THREE.BufferAttribute(places, 3));
    return new THREE.Points(geometry, new THREE.PointsMaterial({ size: 2.5, sizeAttenuation: false, color: 0x1f6fb2 }));
  }

  private boxes(places: Float32Array, side: number): THREE.InstancedMesh {
    const count = places.length / 3, at = new THREE.Matrix4();
    const mesh = new THREE.InstancedMesh(new THREE.BoxGeometry(side, side, side),
      new THREE.MeshStandardMaterial({ color: 0xd8a24a, transparent: true, opacity: 0.45, depthWrite: false }), count);
    for (let i = 0; i < count; ++i) mesh.setMatrixAt(i, at.makeTranslation(places[3 * i], places[3 * i + 1], places[3 * i + 2]));
    return mesh;
  }

  /** Colours the surface; answers the range that the colours span. */
  colour(fieldName: string, map: MapName): [number, number] {
    this.coloured = { field: fieldName, map };
    if (!this.surface) return [0, 1];
    const colours = this.surface.geometry.getAttribute('color') as THREE.BufferAttribute;
    const field = this.fields.find((one) => one.name === fieldName);
    const [low, high] = field ? rangeOf(field.values, map) : [0, 1];
    const table = lookUp(map).map(linear), grey = linear(noValue), plain = linear([0.72, 0.74, 0.77]);
    const pale = new THREE.Color();
    for (let i = 0; i < colours.count; ++i) {
      const x = field ? field.values[i] : 0;
      let c = !field ? plain : Number.isNaN(x) ? grey : table[Math.round(255 * shareOf(x, low, high))];
      if (this.ballVertices && !this.ballVertices.has(i)) c = pale.copy(c).lerp(plain, 0.78);
      colours.setXYZ(i, c.r, c.g, c.b);
    }
    colours.needsUpdate = true;
    this.draw();
    return [low, high];
  }

  // ---- hand ----

  async setHand(glb: ArrayBuffer): Promise<void> {
    const file = await new GLTFLoader().parseAsync(glb, '');
    this.handGroup.clear();
    this.handGroup.add(file.scene);
    this.links = [];
    file.scene.traverse((node) => {
      if (node.userData.kind === 'hand') this.hand = node.userData as unknown as HandModel;
      if (typeof node.userData.link === 'number') this.links[node.userData.link] = node;
      if (node instanceof THREE.Mesh) {
        node.geometry.computeVertexNormals();
        const old = node.material as THREE.MeshStandardMaterial;
        node.material = new THREE.MeshStandardMaterial({ color: old.color, roughness: 0.6, metalness: 0.05 });
      }
    });
    this.draw();
  }

  /** Joint values in the order of the hand's dofs. */
  posture(q: ArrayLike<number>): void {
    for (const joint of this.hand?.joints ?? []) {
      const link = this.links[joint.child];
      if (!link) continue;
      jointPose(joint, q).decompose(link.position, link.quaternion, link.scale);
    }
    this.draw();
  }

  placeHand(p: number[], qWxyz: number[]): void {
    this.handGroup.position.set(p[0], p[1], p[2]);
    this.handGroup.quaternion.set(qWxyz[1], qWxyz[2], qWxyz[3], qWxyz[0]);
    this.draw();
  }

  placeObject(p: THREE.Vector3 | null, q?: THREE.Quaternion): void {
    this.objectGroup.position.copy(p ?? new THREE.Vector3());
    this.objectGroup.quaternion.copy(q ?? new THREE.Quaternion());
    this.draw();
  }

  handOpacity(opacity: number): void {
    this.handGroup.traverse((node) => {
      if (!(node instanceof THREE.Mesh)) return;
      const material = node.material as THREE.MeshStandardMaterial;
      material.transparent = opacity < 1;
      material.opacity = opacity;
      material.depthWrite = opacity === 1;
    });
    this.draw();
  }

  /** The hand along its way, at a time. */
  pose(motion: Motion, time: number): void {
    const [i, t] = keyAt(motion.times_s, time);
    const values = mix(motion.q[i], motion.q[Math.min(i + 1, motion.q.length - 1)], t);
    if (this.hand && values.length > 0)
      this.posture(this.hand.dofs.map((name, k) => {
        const at = motion.joints.indexOf(name);
        return at < 0 ? this.hand!.open[k] : values[at];
      }));
    if (motion.X.length > 0) {
      const { p, q } = poseAt(motion.times_s, motion.X, time);
      this.handGroup.position.copy(p);
      this.handGroup.quaternion.copy(q);
    }
    this.draw();
  }

  /** The object along its own way. */
  poseObject(times: number[], X: number[][], time: number): void {
    const { p, q } = poseAt(times, X, time);
    this.placeObject(p, q);
  }

  // ---- marks ----

  setContacts(contacts: { p: number[]; n: number[] }[]): void {
    this.contacts.clear();
    const size = 0.012 * this.extent();
    for (const { p, n } of contacts) {
      const at = toVector(p), out = toVector(n);
      const mark = new THREE.Mesh(new THREE.SphereGeometry(0.55 * size, 16, 12), new THREE.MeshBasicMaterial({ color: 0xd55e00, depthTest: false }));
      mark.position.copy(at);
      mark.renderOrder = 2;
      const arrow = new THREE.ArrowHelper(out.clone().negate(), at.clone().addScaledVector(out, 6 * size), 6 * size, 0xd55e00, 2 * size, 1.2 * size);
      this.contacts.add(mark, arrow);
    }
    this.draw();
  }

  setCandidates(candidates: Candidate[]): void {
    this.candidates.clear();
    const colours: Record<string, number> = { winding: 0xffffff, curvature: 0x009e73, combined: 0xe69f00, loops: 0xcc79a7, random: 0x555555 };
    const shape = new THREE.SphereGeometry(0.014 * this.extent(), 16, 12);
    candidates.forEach((candidate, index) => {
      const mark = new THREE.Mesh(shape, new THREE.MeshStandardMaterial({ color: colours[candidate.heuristic] ?? 0x56b4e9, roughness: 0.5 }));
      mark.position.copy(toVector(candidate.p_m));
      mark.userData.candidate = index;
      this.candidates.add(mark);
    });
    this.draw();
  }

  private extent(): number {
    if (!this.surface) return 0.1;
    this.surface.geometry.computeBoundingSphere();
    return 2 * (this.surface.geometry.boundingSphere?.radius ?? 0.05);
  }

  /** The ball around a candidate with its axis, plane and path; null takes it away. Answers what the picture holds. */
  showBall(candidate: Candidate | null): BallShown | null {
    this.ball.clear();
    this.ballVertices = null;
    if (!candidate || !this.surface) {
      this.recolour();
      return null;
    }
    const index = this.surface.geometry.index!.array;
    this.links_ ??= linksOf(index, this.surface.geometry.getAttribute('position').count);
    this.ballVertices = new Set(ballByHops(this.links_, candidate.vertex, candidate.radius_m || this.radius, this.hop));
    const size = this.extent();
    const top = new THREE.Mesh(new THREE.SphereGeometry(0.02 * size, 20, 14), new THREE.MeshBasicMaterial({ color: 0xd55e00 }));
    top.position.copy(toVector(candidate.p_m));
    this.ball.add(top);
    const { center, axis, path, closed } = candidate.ball;
    if (center && axis) {
      const at = toVector(center), along = toVector(axis).normalize();
      const reach = Math.max(...path.map((p) => toVector(p).distanceTo(at)), 0.1 * size);
      const line = new THREE.Mesh(new THREE.CylinderGeometry(0.006 * size, 0.006 * size, 2.6 * reach), new THREE.MeshBasicMaterial({ color: 0x0072b2 }));
      line.position.copy(at);
      line.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along);
      const disc = new THREE.Mesh(new THREE.CircleGeometry(1.25 * reach, 48),
        new THREE.MeshBasicMaterial({ color: 0x56b4e9, transparent: true, opacity: 0.3, side: THREE.DoubleSide, depthWrite: false }));
      disc.position.copy(at);
      disc.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), along);
      this.ball.add(line, disc);
    }
    if (path.length > 1) {
      const points = path.map(toVector);
      for (let i = 0; i + (closed ? 0 : 1) < points.length; ++i) {
        const a = points[i], b = points[(i + 1) % points.length], length = a.distanceTo(b);
        if (length < 1e-6) continue;
        const piece = new THREE.Mesh(new THREE.CylinderGeometry(0.008 * size, 0.008 * size, length, 8), new THREE.MeshBasicMaterial({ color: 0xd55e00 }));
        piece.position.copy(a).add(b).multiplyScalar(0.5);
        piece.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), b.clone().sub(a).normalize());
        this.ball.add(piece);
      }
    }
    this.recolour();
    return { vertices: this.ballVertices.size };
  }

  private recolour(): void {
    this.colour(this.coloured.field, this.coloured.map);
  }

  show(part: Parts, on: boolean): void {
    if (part === 'edges' && on && !this.edges && this.surface) {
      this.edges = new THREE.LineSegments(new THREE.WireframeGeometry(this.surface.geometry),
        new THREE.LineBasicMaterial({ color: 0x000000, transparent: true, opacity: 0.25 }));
      this.objectGroup.add(this.edges);
    }
    const parts: Record<Parts, THREE.Object3D | null> = {
      hand: this.handGroup, cloud: this.cloud, voxels: this.voxels, candidates: this.candidates, contacts: this.contacts, edges: this.edges,
    };
    if (parts[part]) parts[part]!.visible = on;
    this.draw();
  }

  has(part: Parts): boolean {
    return part === 'cloud' ? this.cloud !== null : part === 'voxels' ? this.voxels !== null : part === 'hand' ? this.hand !== null : true;
  }

  /** Cuts away what lies beyond `share` (0..1) of the object along an axis; null shows all. */
  section(axis: 'x' | 'y' | 'z' | null, share = 0.5): number {
    if (!this.surface) return 0;
    this.surface.geometry.computeBoundingBox();
    const box = this.surface.geometry.boundingBox!;
    const on = axis !== null;
    let at = 0;
    if (axis) {
      const normal = new THREE.Vector3(axis === 'x' ? -1 : 0, axis === 'y' ? -1 : 0, axis === 'z' ? -1 : 0);
      at = box.min[axis] + share * (box.max[axis] - box.min[axis]);
      this.plane.set(normal, at);
    }
    if (on !== this.sectionOn) {
      this.sectionOn = on;
      for (const mesh of [this.surface, this.inside!]) {
        const material = mesh.material as THREE.Material;
        material.clippingPlanes = on ? [this.plane] : [];
        material.needsUpdate = true;
      }
    }
    this.draw();
    return at;
  }

  // ---- looking ----

  /** Looks at everything from a little above. */
  look(from?: [number, number, number]): void {
    const box = new THREE.Box3().setFromObject(this.objectGroup);
    const whole = box.clone();
    if (this.hand && this.handGroup.visible) whole.expandByObject(this.handGroup);
    const middle = whole.getCenter(new THREE.Vector3()), size = whole.getSize(new THREE.Vector3()).length() || 0.2;
    const up = this.camera.up, side = Math.abs(up.x) < 0.8 ? new THREE.Vector3(1, 0, 0) : new THREE.Vector3(0, 1, 0);
    const right = new THREE.Vector3().crossVectors(side, up).normalize(), ahead = new THREE.Vector3().crossVectors(up, right).normalize();
    const direction = from ? new THREE.Vector3(...from)
      : new THREE.Vector3().addScaledVector(right, 0.65).addScaledVector(ahead, 0.6).addScaledVector(up, 0.5);
    const angle = (this.camera.fov * Math.PI) / 360;
    const distance = (0.5 * size) / Math.sin(angle) / Math.min(1, this.camera.aspect) * 0.72;
    this.controls.target.copy(middle);
    this.camera.position.copy(middle).addScaledVector(direction.normalize(), distance);
    this.camera.near = distance / 100;
    this.camera.far = distance * 20;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.draw();
  }

  get eye(): number[] {
    return [...this.camera.position.toArray(), ...this.controls.target.toArray()].map((x) => Math.round(x * 1e4) / 1e4);
  }
  set eye(place: number[]) {
    if (place.length !== 6 || place.some((x) => !Number.isFinite(x))) return;
    this.camera.position.set(place[0], place[1], place[2]);
    this.controls.target.set(place[3], place[4], place[5]);
    this.controls.update();
    this.draw();
  }

  private key(event: KeyboardEvent): void {
    const turn = 0.12;
    const offset = this.camera.position.clone().sub(this.controls.target);
    const aside = new THREE.Vector3().crossVectors(this.camera.up, offset).normalize();
    const moves: Record<string, () => void> = {
      ArrowLeft: () => offset.applyAxisAngle(this.camera.up, -turn),
      ArrowRight: () => offset.applyAxisAngle(this.camera.up, turn),
      ArrowUp: () => this.tilt(offset, aside, -turn),
      ArrowDown: () => this.tilt(offset, aside, turn),
      '+': () => offset.multiplyScalar(1 / 1.1),
      '=': () => offset.multiplyScalar(1 / 1.1),
      '-': () => offset.multiplyScalar(1.1),
    };
    if (event.key === '0') this.look();
    else if (event.key in moves) {
      moves[event.key]();
      this.camera.position.copy(this.controls.target).add(offset);
      this.controls.update();
    } else return;
    event.preventDefault();
    this.draw();
    this.onCamera();
  }

  private tilt(offset: THREE.Vector3, aside: THREE.Vector3, by: number): void {
    const after = offset.clone().applyAxisAngle(aside, by), angle = after.angleTo(this.camera.up);
    if (angle > 0.05 && angle < Math.PI - 0.05) offset.copy(after);
  }

  private pick(event: PointerEvent): void {
    const box = this.canvas.getBoundingClientRect();
    const at = new THREE.Vector2(((event.clientX - box.left) / box.width) * 2 - 1, 1 - ((event.clientY - box.top) / box.height) * 2);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(at, this.camera);
    const mark = this.candidates.visible ? ray.intersectObjects(this.candidates.children)[0] : undefined;
    if (mark) return this.onCandidate(mark.object.userData.candidate);
    const hit = this.surface ? ray.intersectObject(this.surface).find((one) => !this.sectionOn || this.plane.distanceToPoint(one.point) > 0) : undefined;
    if (!hit?.face || !this.surface) return this.onProbe(null);
    const positions = this.surface.geometry.getAttribute('position'), local = this.surface.worldToLocal(hit.point.clone());
    const near = [hit.face.a, hit.face.b, hit.face.c].map((v) => ({ v, d: new THREE.Vector3().fromBufferAttribute(positions, v).distanceTo(local) }));
    const vertex = near.sort((a, b) => a.d - b.d)[0].v;
    this.onProbe({ vertex, fields: this.fields.map((field) => ({ name: field.name, title: field.title, value: field.values[vertex] })) });
  }

  /** What is shown, as glTF: object with its colours, hand in its posture. */
  async glb(): Promise<ArrayBuffer> {
    const shown = new THREE.Group();
    if (this.surface) shown.add(new THREE.Mesh(this.surface.geometry, new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.8 })));
    if (this.hand && this.handGroup.visible) shown.add(this.handGroup.clone());
    return (await new GLTFExporter().parseAsync(shown, { binary: true })) as ArrayBuffer;
  }

  picture(): string {
    this.renderer.render(this.scene, this.camera);
    return this.canvas.toDataURL('image/png');
  }
}

export interface SceneModule { View: typeof View }
declare const geocage: { module(name: string, api: SceneModule): void };
geocage.module('scene', { View });
