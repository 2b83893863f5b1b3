import sys, math, os, re
# open scene: textured.xml with two bumpy balls of 8,000 triangles (63 x 64 x 2 = 8,064), interpolated normals: one of rough gold, one diffuse
out=sys.argv[1]; os.makedirs(out,exist_ok=True)
def ball(path,seed,c,r,nu=64,nv=64):
    V=[];F=[]
    def rad(t,p): return r*(1+0.05*math.sin(5*t+seed)*math.sin(6*p))
    V.append((c[0],c[1]+rad(0,0),c[2]))
    for i in range(1,nv):
        t=math.pi*i/nv
        for j in range(nu):
            p=2*math.pi*j/nu; q=rad(t,p)
            V.append((c[0]+q*math.sin(t)*math.cos(p),c[1]+q*math.cos(t),c[2]+q*math.sin(t)*math.sin(p)))
    V.append((c[0],c[1]-rad(math.pi,0),c[2]))
    idx=lambda i,j:2+(i-1)*nu+(j%nu)
    for j in range(nu):
        F.append((1,idx(1,j+1),idx(1,j)))
        F.append((len(V),idx(nv-1,j),idx(nv-1,j+1)))
        for i in range(1,nv-1):
            F.append((idx(i,j),idx(i,j+1),idx(i+1,j)))
            F.append((idx(i,j+1),idx(i+1,j+1),idx(i+1,j)))
    with open(path,'w') as f:
        for v in V: f.write('v %.7g %.7g %.7g\n'%v)
        for a in F: f.write('f %d %d %d\n'%a)
    print(path,len(F))
ball(out+'/a.obj',1,(-1.3,0.75,0.2),0.7)
ball(out+'/b.obj',2,(1.6,0.6,-0.6),0.55)
t=open('scenes/textured.xml').read().replace('textured/waves.png',os.path.abspath('scenes/textured/waves.png'))
extra='''<shape type="obj"><string name="filename" value="a.obj"/><bsdf type="roughconductor"><string name="material" value="Au"/><string name="distribution" value="ggx"/><float name="alpha" value="0.3"/></bsdf></shape>
<shape type="obj"><string name="filename" value="b.obj"/><bsdf type="diffuse"><rgb name="reflectance" value="0.6,0.3,0.2"/></bsdf></shape>
</scene>'''
open(out+'/open.xml','w').write(t.replace('</scene>',extra))
